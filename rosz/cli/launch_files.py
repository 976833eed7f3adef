"""Which launch files a command line of ``rosz launch`` names."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rosz.errors import NotFoundError, UsageError

if TYPE_CHECKING:
    from rosz.launch.plan import LaunchText
    from rosz.packages import PackageIndex

__all__ = ("find_files",)

_LISTED = 8


def find_files(words: Sequence[str], packages: PackageIndex) -> list[str | LaunchText]:
    """Return the launch files that a command line names.

    Args:
        words: A package and a file of it, then paths; or paths alone; one of them may be ``-``.
        packages: Where packages are looked up.

    Raises:
        UsageError: No file is named, or standard input twice.
        NotFoundError: A file is not there.
    """
    if not words:
        raise UsageError("no launch file is given: rosz launch PACKAGE FILE, or rosz launch PATH")
    if words.count("-") > 1:
        raise UsageError("'-' is given twice; standard input can be read only once")
    first, rest = _first(words, packages)
    for word in rest:
        if word != "-" and not Path(word).is_file():
            raise NotFoundError(f"launch file '{word}' is not there")
    return [_read_stdin() if word == "-" else word for word in (first, *rest)]


def _first(words: Sequence[str], packages: PackageIndex) -> tuple[str, Sequence[str]]:
    name = words[0]
    is_file = name == "-" or Path(name).is_file()
    if len(words) > 1 and "/" not in name and name != "-":
        try:
            return str(packages.find(name).file(words[1])), words[2:]
        except NotFoundError:
            if not is_file:
                raise
    if is_file:
        return name, words[1:]
    if Path(name).is_dir() and ("/" in name or name not in packages.names()):
        raise NotFoundError(f"'{name}' is a folder; name a launch file in it")
    raise NotFoundError(f"launch file '{name}' is not there{_hint(name, packages)}")


def _hint(name: str, packages: PackageIndex) -> str:
    """Say where a file of that name is, or what else a lone word might have meant."""
    if "/" in name:
        return ""
    if Path("launch", name).is_file():
        return f"; did you mean 'launch/{name}'?"
    if name in packages.names():
        own = sorted({file.name for file in packages.find(name).path.rglob("*.launch")})
        if not own:
            return f"; '{name}' is a package, and has no launch files"
        which = f", such as {', '.join(own[:_LISTED])}"
        return f"; '{name}' is a package: name one of its launch files as well{which}"
    holders = [
        package.name
        for package in packages.packages()
        if (package.path / "launch" / name).is_file()
    ]
    if holders:
        return f"; package '{holders[0]}' has it: rosz launch {holders[0]} {name}"
    return "; give its path, or a package and a file: rosz launch PACKAGE FILE"


def _read_stdin() -> LaunchText:
    from rosz.launch.plan import LaunchText

    return LaunchText(sys.stdin.buffer.read())
