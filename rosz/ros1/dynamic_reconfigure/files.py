"""Where a package has its ``.cfg`` files."""

from __future__ import annotations

from pathlib import Path

__all__ = ("find_files",)

_MARK = b"dynamic_reconfigure"


def find_files(folder: Path) -> list[Path]:
    """Return the ``.cfg`` files of a package that describe parameters, sorted.

    Args:
        folder: The package's; files named so for other purposes (``setup.cfg``) are left out.
    """
    return [file for file in sorted(folder.rglob("*.cfg")) if _is_ours(file)]


def _is_ours(file: Path) -> bool:
    try:
        return _MARK in file.read_bytes()
    except OSError:  # a folder of such a name, a link to nowhere
        return False
