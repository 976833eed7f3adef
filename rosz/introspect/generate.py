"""Python modules for the messages and services of a user's package."""

from __future__ import annotations

from pathlib import Path

from rosz.errors import NotFoundError, PackageNotFound, UsageError
from rosz.idl.catalog import Catalog, Definition
from rosz.idl.generate import Folders, generate, shipped_module, stale, write
from rosz.idl.module import MARKER
from rosz.packages import Package, PackageIndex
from rosz.typestore import TypeStore

__all__ = ("Generator",)


class Generator:
    """Writes modules ``<package>/msg.py`` and ``<package>/srv.py``.

    Args:
        index: Where packages are.
        output: Folder to write below; ``src`` of each package when not given.
    """

    def __init__(self, index: PackageIndex, output: Path | None) -> None:
        self._index = index
        self._output = output
        self._store = TypeStore(index)
        self._shipped = TypeStore()

    def package(self, word: str, cwd: Path) -> Package:
        """Return the package that a word means.

        Args:
            word: Its name, its folder, or nothing for the package around the working folder.
            cwd: The working folder.

        Raises:
            PackageNotFound: There is no such package.
            UsageError: There is none around the working folder.
        """
        if not word:
            for folder in (cwd, *cwd.parents):
                if (folder / "package.xml").is_file():
                    return PackageIndex([folder]).packages()[0]
            raise UsageError("no package is given, and this folder is in none: rosz gen PACKAGE")
        folder = (cwd / word).resolve()
        if (folder / "package.xml").is_file():
            return PackageIndex([folder]).packages()[0]
        return self._index.find(word)

    def folder(self, package: Package) -> Path:
        """Return the folder that a package's modules go to."""
        return (self._output or package.path / "src") / package.name

    def _files(self, package: Package) -> dict[str, str]:
        folders = Folders(lambda name: self._path(package, name))

        def find(name: str) -> Definition:
            return folders.find(name) if name.startswith(f"{package.name}/") else self._other(name)

        files = generate(package.name, folders, Catalog(find), self._place)
        if set(files) == {"__init__.py"}:
            raise NotFoundError(
                f"package '{package.name}' ({package.path}) has no msg/*.msg and no srv/*.srv"
            )
        return files

    def _path(self, package: Package, name: str) -> Path | None:
        if name == package.name:
            return package.path
        try:
            return self._index.find(name).path
        except PackageNotFound:
            return None

    def _other(self, name: str) -> Definition:
        return self._store.definition(name)

    def _place(self, name: str) -> str:
        """Return the module of a type of another package."""
        package, kind, _ = name.split("/")
        short = f"{package}/{name.rpartition('/')[2]}"
        if package in self._shipped.packages() and short in self._shipped.names("msg", package):
            return shipped_module(name)
        return f"{package}.{kind}"

    def stale(self, package: Package) -> list[str]:
        """Return what differs between the modules there are and what they should be.

        Raises:
            DefinitionError: A definition is not well-formed.
            NotFoundError: The package has no definitions.
        """
        return list(stale(self._files(package), self.folder(package)))

    def write(self, package: Package) -> list[Path]:
        """Write the modules of a package, and return the files.

        Raises:
            DefinitionError: A definition is not well-formed.
            NotFoundError: The package has no definitions.
            UsageError: A file that a person wrote is in the way.
        """
        files = self._files(package)
        folder = self.folder(package)
        for name in files:
            file = folder / name
            if file.is_file() and not file.read_text("utf-8").startswith(MARKER):
                raise UsageError(f"'{file}' was not generated: it stays; choose a folder with -o")
        write(files, folder)
        return [folder / name for name in sorted(files)]
