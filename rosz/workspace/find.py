"""Which packages a person means: those named, or all of the workspace around a folder."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from rosz.environment import Environment
from rosz.errors import NotFoundError
from rosz.packages import MANIFEST, PackageIndex, crawl

__all__ = ("find_packages",)


def find_packages(words: Sequence[str], cwd: Path, index: PackageIndex) -> list[Path]:
    """Return the folders of packages, sorted, each once.

    Args:
        words: Folders that are packages or hold some, or names of packages; with none, those of the
            workspace around the working folder.
        cwd: The working folder.
        index: Where names are looked up.

    Raises:
        NotFoundError: There is no such package, or there is none at all.
    """
    found = sorted({folder.resolve() for folder in _folders(words, cwd, index)})
    if not found:
        where = ", ".join(words) or f"the workspace around {cwd}"
        raise NotFoundError(
            f"no package in {where}: expected folders with a {MANIFEST} below src; make one with"
            " 'rosz pkg create NAME'"
        )
    return found


def _folders(words: Sequence[str], cwd: Path, index: PackageIndex) -> Iterator[Path]:
    if not words:
        for root in Environment.read({}, cwd).package_roots:
            yield from crawl(root)
    for word in words:
        path = cwd / word
        if path.is_file():
            raise NotFoundError(f"'{word}' is a file; expected a package or a folder")
        if path.is_dir():
            inside = path / "src" if (path / "src").is_dir() else path
            yield from crawl(path if (path / MANIFEST).is_file() else inside)
        else:
            yield index.find(word).path
