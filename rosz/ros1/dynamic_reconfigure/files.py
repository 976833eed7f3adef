"""The ``.cfg`` files of a package; a module of its own, because the importer needs only this."""

from __future__ import annotations

from pathlib import Path

__all__ = ("find_files",)

_MARK = b"dynamic_reconfigure"


def find_files(folder: Path) -> list[Path]:
    """Return the sorted ``.cfg`` files of a package that describe parameters.

    Args:
        folder: Folder of the package; other files with such names (``setup.cfg``) are left out.
    """
    return [file for file in sorted(folder.rglob("*.cfg")) if _describes_parameters(file)]


def _describes_parameters(file: Path) -> bool:
    try:
        return _MARK in file.read_bytes()
    except OSError:  # a folder, or a broken link
        return False
