"""The problems that checks find in packages."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal

import msgspec

from rosz.errors import LaunchFileError, PackageNotFound, SourceError

_ABSENT = re.compile(r"package '([^']+)' not found")
_MISTYPED = "did you mean"
REMEDY = "; run: "
"""Text before the command that fixes a problem."""


class Problem(msgspec.Struct, frozen=True, order=True):
    """A problem in a package.

    Attributes:
        path: Path of the file or folder.
        line: 1-based line, or 0 for the whole file.
        column: 1-based column, or 0 if unknown.
        level: ``error``, or ``warning`` if it still works with rosz.
        text: Description of the problem, and a remedy.
        missing: Name of the package whose absence is the only fault; or empty.
    """

    path: str
    line: int
    column: int
    level: Literal["error", "warning"]
    text: str
    missing: str = ""

    @property
    def place(self) -> str:
        """``path:line:column``, as far as known."""
        return ":".join(str(part) for part in (self.path, self.line, self.column) if part)


def error(path: Path, text: str, line: int = 0, column: int = 0) -> Problem:
    """Return a problem that prevents something from working."""
    return Problem(str(path), line, column, "error", text)


def warning(path: Path, text: str, line: int = 0, column: int = 0) -> Problem:
    """Return a problem that programs other than rosz may have with the file."""
    return Problem(str(path), line, column, "warning", text)


def from_error(fault: Exception, path: Path) -> Problem:
    """Return the problem that an exception describes, at its own place if it has one.

    A package that is not there is a warning, unless its name may be mistyped.
    """
    if not isinstance(fault, SourceError):
        return error(path, str(fault))
    # Several launch files may include the wrong one.
    reason = fault.plain_reason if isinstance(fault, LaunchFileError) else fault.reason
    absent = _ABSENT.match(reason)
    if absent is None:
        return Problem(fault.path, fault.line, fault.column, "error", reason)
    if _MISTYPED in reason:
        text = _mistyped(absent[1], reason)
        return Problem(fault.path, fault.line, fault.column, "error", text)
    return Problem(fault.path, fault.line, fault.column, "warning", reason, absent[1])


def from_absence(fault: PackageNotFound, path: Path, node: str, place: tuple[int, int]) -> Problem:
    """Return the problem of a node whose package is not there."""
    if _MISTYPED in str(fault):
        return Problem(str(path), *place, "warning", _mistyped(fault.package, str(fault)))
    return Problem(str(path), *place, "warning", f"node '{node}': {fault}", fault.package)


def _mistyped(package: str, reason: str) -> str:
    """Return a text that is the same wherever the package is needed."""
    return f"package '{package}' not found; {_MISTYPED}{reason.partition(_MISTYPED)[2]}"
