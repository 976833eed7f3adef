"""The problems that checks find in packages."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import msgspec

from rosz.errors import SourceError

__all__ = ("REMEDY", "Problem", "error", "from_error", "warning")

REMEDY = "; run: "
"""Text before the command that fixes a problem."""


class Problem(msgspec.Struct, frozen=True, order=True):
    """A problem in a package.

    Attributes:
        path: Path of the file or folder.
        line: 1-based line, or 0 for the whole file.
        column: 1-based column, or 0 if unknown.
        level: ``error``, or ``warning`` for what still works with rosz.
        text: Description of the problem, and what to do.
    """

    path: str
    line: int
    column: int
    level: Literal["error", "warning"]
    text: str

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
    """Return the problem that an exception describes, at its own place if it has one."""
    if isinstance(fault, SourceError):
        return Problem(fault.path, fault.line, fault.column, "error", fault.reason)
    return error(path, str(fault))
