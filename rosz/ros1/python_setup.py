"""The Python modules that packages offer to others, as their setup.py says.

A file keeps the modules of each setup.py (`setup_reader`), which is read again when it has changed.
The importer looks for modules here, so little is imported before it is needed.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path

import msgspec

from rosz.packages import PackageIndex

_SETUP = "setup.py"


class Offered(msgspec.Struct, frozen=True):
    """The modules that a package offers.

    Attributes:
        modules: Folders and files of modules by name, without those inside of other modules.
        folders: Folders of which all packages are offered, as by ``find_packages``, each with
            patterns of names that are not.
    """

    modules: dict[str, str] = {}
    folders: list[tuple[str, list[str]]] = []


class _Read(msgspec.Struct, frozen=True):
    """The contents of a setup.py with this time of change and size."""

    changed: int
    size: int
    offered: Offered


class Offers:
    """The modules that all packages offer.

    Args:
        index: The packages.
        memory: File that keeps the modules.
    """

    def __init__(self, index: PackageIndex, memory: Path) -> None:
        self._index = index
        self._memory = memory

    def find(self, name: str) -> Path | None:
        """Return the folder or file of a module by its name without dots, or None."""
        module = self._modules.get(name)
        if module is not None and is_module(module):
            return module
        for folder, excluded in self._folders:
            hidden = any(fnmatchcase(name, pattern) for pattern in excluded)
            if is_module(folder / name) and not hidden:
                return folder / name
        # Also without a setup.py: packages of catkin and ament_cmake have their code there.
        package = self._paths.get(name)
        own = () if package is None else (f"src/{name}", f"src/{name}.py", name)
        return next((package / path for path in own if package and is_module(package / path)), None)

    def names(self) -> Iterator[str]:
        """Yield the names of all modules, maybe twice."""
        yield from self._modules
        for folder, _ in self._folders:
            yield from (file.parent.name for file in folder.glob("*/__init__.py"))
        places = ((name, path / "src" / name, path / name) for name, path in self._paths.items())
        yield from (name for name, *own in places if any(map(is_module, own)))

    @cached_property
    def _paths(self) -> dict[str, Path]:
        return {package.name: package.path for package in self._index.packages()}

    @cached_property
    def _modules(self) -> dict[str, Path]:
        """Modules by name; the one of a package of the same name is preferred."""
        return {
            module: Path(path)
            for wanted in (False, True)
            for name, offered in self._offered.items()
            for module, path in offered.modules.items()
            if (module == name) is wanted
        }

    @cached_property
    def _folders(self) -> list[tuple[Path, list[str]]]:
        return [
            (Path(folder), excluded)
            for offered in self._offered.values()
            for folder, excluded in offered.folders
        ]

    @cached_property
    def _offered(self) -> dict[str, Offered]:
        kept = self._kept()
        modules: dict[str, Offered] = {}
        fresh: dict[str, _Read] = {}
        for name, folder in self._paths.items():
            file = folder / _SETUP
            try:
                state = file.stat()
            except OSError:
                continue
            read = kept.get(str(file))
            if read is None or (read.changed, read.size) != (state.st_mtime_ns, state.st_size):
                from rosz.ros1.setup_reader import read_setup

                offered = Offered(*read_setup(folder))
                read = _Read(state.st_mtime_ns, state.st_size, offered)
                fresh[str(file)] = read
            modules[name] = read.offered
        if fresh:
            self._keep(kept | fresh)
        return modules

    def _kept(self) -> dict[str, _Read]:
        try:
            return msgspec.json.decode(self._memory.read_bytes(), type=dict[str, _Read])
        except (OSError, msgspec.DecodeError):  # there is none yet, or one of another release
            return {}

    def _keep(self, read: dict[str, _Read]) -> None:
        """Write the file atomically, since other processes may write it too."""
        present = {path: entry for path, entry in read.items() if Path(path).exists()}
        from tempfile import NamedTemporaryFile

        with suppress(OSError):  # a read-only home: each process reads for itself
            self._memory.parent.mkdir(parents=True, exist_ok=True)
            with NamedTemporaryFile(dir=self._memory.parent, suffix=".tmp", delete=False) as new:
                new.write(msgspec.json.encode(present))
            Path(new.name).replace(self._memory)


def is_module(path: Path) -> bool:
    """Return whether a path is that of a module, or the folder of one."""
    return path.is_file() if path.suffix == ".py" else (path / "__init__.py").is_file()
