"""Python modules for the messages and services of a package, and of rosz itself."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rosz.errors import NotFoundError, PackageNotFound, TypeNotFound, UsageError
from rosz.idl.generate import MARKER, shipped_sources, stale, write
from rosz.packages import MANIFEST, Package, PackageIndex, manifest_of
from rosz.typestore import TypeStore, shipped_packages

_Sources = dict[Path, dict[str, str]]
"""Sources by folder and file name."""


class Generator:
    """Writes modules ``<package>/msg.py`` and ``<package>/srv.py``, or finds stale ones.

    Args:
        index: Index of packages.
        output: Folder to write to, dependencies included; None to write each package's own modules
            to its ``src``.
        cwd: Working folder.
    """

    def __init__(self, index: PackageIndex, output: Path | None, cwd: Path) -> None:
        self._index = index
        self._output = output
        self._cwd = cwd

    def stale(self, words: list[str]) -> list[str]:
        """Return the differences between the modules on disk and fresh ones.

        Args:
            words: Names or folders of packages. If empty, the package around the working folder,
                or, in rosz's own source tree, the modules that it ships.

        Raises:
            DefinitionError: A definition is not well-formed.
            NotFoundError: A package does not exist, or has no definitions.
            UsageError: No package is given, and the working folder is in none.
        """
        sources = self._sources(words)
        return [line for folder, files in sources.items() for line in stale(files, folder)]

    def write(self, words: list[str]) -> list[Path]:
        """Write the modules, and return their files; arguments and errors as those of `stale`.

        Raises:
            UsageError: Also if a file that was not generated is in the way.
        """
        sources = self._sources(words)
        for folder, files in sources.items():
            for name in files:
                file = folder / name
                if file.is_file() and not file.read_text("utf-8").startswith(MARKER):
                    raise UsageError(
                        f"'{file}' was not generated, and is not overwritten; choose a folder"
                        " with -o"
                    )
        for folder, files in sources.items():
            write(files, folder)
        return [folder / name for folder, files in sources.items() for name in sorted(files)]

    def _sources(self, words: list[str]) -> _Sources:
        source_tree = self._cwd / "interfaces", self._cwd / "rosz" / "msgs"
        if not words and all(folder.is_dir() for folder in source_tree):
            interfaces, modules = source_tree
            return {modules / name: files for name, files in shipped_sources(interfaces).items()}
        return dict(self._of_packages(words or [self._around()]))

    def _of_packages(self, words: list[str]) -> Iterator[tuple[Path, dict[str, str]]]:
        for word in words:
            folder = (self._cwd / word).resolve()
            given = [folder] if manifest_of(folder) else []
            index = PackageIndex([*given, *self._index.roots])
            package = PackageIndex(given).packages()[0] if given else _find(index, word, folder)
            sources = _sources(index, package.name)
            if self._output is None:
                yield package.path / "src" / package.name, sources[package.name]
            else:
                yield from ((self._output / name, files) for name, files in sources.items())

    def _around(self) -> str:
        for folder in (self._cwd, *self._cwd.parents):
            if manifest_of(folder) is not None:
                return str(folder)
        raise UsageError("no package is given, and this folder is in none: rosz gen PACKAGE")


def _find(index: PackageIndex, name: str, folder: Path) -> Package:
    """Return a package by its name, with a better error where a folder has that name."""
    try:
        return index.find(name)
    except PackageNotFound as error:
        if not folder.exists():
            raise
        raise NotFoundError(
            f"'{folder}' is not a package: it has no {MANIFEST}; 'rosz pkg create NAME' makes one"
        ) from error


def _sources(index: PackageIndex, name: str) -> dict[str, dict[str, str]]:
    """Return the sources of a package and of the packages that it depends on."""
    try:
        return TypeStore(index).sources([name])
    except TypeNotFound as error:
        hint = f"; rosz brings 'rosz.msgs.{name}'" if name in shipped_packages() else ""
        text = f"package '{name}' has no types of its own that modules could be made of{hint}"
        raise NotFoundError(text) from error
