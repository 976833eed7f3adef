"""Types by name: the shipped classes, and those of any package on the package path.

A package that rosz does not ship is compiled when the first of its types is asked for, whole, into
a module like the shipped ones. The generated source is kept in a cache folder under a name made of
what it was generated from, so that other processes need not generate it again; tracebacks show its
lines. Where the folder cannot be written, the source lives in memory only.
"""

from __future__ import annotations

import hashlib
import linecache
import os
import re
import sys
import tempfile
from collections.abc import Sequence
from functools import cached_property
from importlib import import_module
from importlib.abc import Loader
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, TypeAlias

import rosz.idl
import rosz.message
import rosz.msgs
from rosz.errors import PackageNotFound, TypeNotFound, near_miss
from rosz.idl.catalog import Catalog, Definition
from rosz.idl.generate import Folders, generate, shipped_module
from rosz.idl.module import MARKER, message_module, service_module
from rosz.message import Message, Service
from rosz.packages import PackageIndex

__all__ = ("Kind", "TypeStore", "is_generated", "shipped_packages")

Kind: TypeAlias = Literal["msg", "srv"]

_NAME = re.compile(r"([A-Za-z]\w*)/(?:(msg|srv)/)?([A-Za-z]\w*)", re.ASCII)


class _StaleError(Exception):
    """A cached module was generated against another definition of a type in it."""


class TypeStore:
    """Finds message and service classes by name.

    Args:
        packages: Where packages that rosz does not ship are; none when not given. What rosz ships
            comes first, so that it stays what ROS 2 understands.
        cache: Folder for generated sources; none are kept when not given.
    """

    def __init__(self, packages: PackageIndex | None = None, cache: Path | None = None) -> None:
        self._packages = packages
        self._cache = cache
        self._modules: dict[tuple[str, Kind], ModuleType] = {}
        self._folders = Folders(self._folder)
        self._catalog = Catalog(self.definition)

    def message(self, name: str) -> type[Message]:
        """Return a message class.

        Args:
            name: ``std_msgs/String`` or ``std_msgs/msg/String``.

        Raises:
            TypeNotFound: There is no such type.
            DefinitionError: Its package has a definition that is not well-formed.
        """
        cls: type[Message] = self._class(name, "msg")
        return cls

    def service(self, name: str) -> type[Service]:
        """Return a service class.

        Args:
            name: ``std_srvs/SetBool`` or ``std_srvs/srv/SetBool``.

        Raises:
            TypeNotFound: There is no such type.
            DefinitionError: Its package has a definition that is not well-formed.
        """
        cls: type[Service] = self._class(name, "srv")
        return cls

    def names(self, kind: Kind, package: str | None = None) -> list[str]:
        """Return the names of all types of a kind, as ``std_msgs/String``, sorted.

        Args:
            kind: Messages or services.
            package: Only those of this package.

        Raises:
            PackageNotFound: There is no such package.
        """
        if package is not None:
            if package not in self.packages():
                raise PackageNotFound(package, self.packages(), self._searched())
            return [f"{package}/{base}" for base in self._bases(package, kind)]
        return [f"{each}/{base}" for each in self.packages() for base in self._bases(each, kind)]

    def packages(self, kind: Kind | None = None) -> list[str]:
        """Return the names of all packages that have types, or types of one kind, sorted."""
        known = set(shipped_packages())
        if self._packages is not None:
            known |= set(self._packages.names())
        kinds: tuple[Kind, ...] = ("msg", "srv") if kind is None else (kind,)
        return sorted(p for p in known if any(self._bases(p, each) for each in kinds))

    def has(self, package: str, kind: Kind) -> bool:
        """Tell whether a package has types of a kind."""
        return bool(_shipped(package, kind) or self._folders.names(package, kind))

    def definition(self, name: str) -> Definition:
        """Return the text of a type and where it is.

        Args:
            name: Full name, ``std_msgs/msg/String`` or ``std_srvs/srv/SetBool``.

        Raises:
            TypeNotFound: There is no such type.
            DefinitionError: The file cannot be read.
        """
        package, _, base = name.split("/")
        if _is_shipped(name):
            cls = getattr(import_module(shipped_module(name)), base)
            return Definition(cls._text, f"<{name}>")
        if self._folder(package) is None:
            raise TypeNotFound(name, f"there is no package '{package}'{self._near(package)}")
        return self._folders.find(name)

    def module(self, package: str, kind: Kind) -> ModuleType:
        """Return the module with all types of one kind that a package has.

        Raises:
            TypeNotFound: It has none.
            DefinitionError: One of its definitions is not well-formed.
        """
        key = package, kind
        if key not in self._modules:
            self._modules.setdefault(key, self._make(package, kind))
        return self._modules[key]

    def sources(self, packages: Sequence[str]) -> dict[str, dict[str, str]]:
        """Generate importable modules of packages, and of those that they depend on.

        What rosz ships is imported from there and not generated again.

        Args:
            packages: Names of packages on the package path.

        Returns:
            Sources by package and file name; the folders of the packages belong side by side into a
            folder on Python's path.

        Raises:
            PackageNotFound: There is no such package.
            TypeNotFound: A package has no types of its own.
            DefinitionError: A definition is not well-formed, or refers to what is not there.
        """
        done: dict[str, dict[str, str]] = {}
        rest = list(packages)
        while rest:
            package = rest.pop(0)
            if package in done:
                continue
            messages, services = (self._own_names(package, kind) for kind in ("msg", "srv"))
            if self._folder(package) is None:
                raise PackageNotFound(package, self.packages(), self._searched())
            if not messages and not services:
                raise TypeNotFound(package, f"package '{package}' has no types of its own")
            done[package] = generate(package, messages, services, self._catalog, self._place)
            specs = [self._catalog.message(name) for name in messages]
            for name in services:
                service = self._catalog.service(name)
                specs += [service.request, service.response]
            below = {name for spec in specs for name in self._catalog.below(spec)}
            rest += sorted({name.partition("/")[0] for name in below if not _is_shipped(name)})
        return done

    def _place(self, name: str) -> str:
        """Return the module that generated code imports a class from."""
        package, kind, _ = name.split("/")
        return shipped_module(name) if _is_shipped(name) else f"{package}.{kind}"

    def _own_names(self, package: str, kind: str) -> list[str]:
        """List the full names of a package's types that rosz does not ship."""
        return [name for name in self._folders.names(package, kind) if not _is_shipped(name)]

    def _class(self, name: str, kind: Kind) -> Any:
        match = _NAME.fullmatch(name)
        if match is None or match[2] not in (None, kind):
            raise TypeNotFound(name, f"expected a name such as 'package/Type' of a {kind}")
        package, base = match[1], match[3]
        if base not in self._bases(package, kind):
            raise TypeNotFound(name, self._why_not(package, kind, base))
        if base in _shipped(package, kind):
            return getattr(import_module(shipped_module(f"{package}/{kind}/{base}")), base)
        return getattr(self.module(package, kind), base)

    def _why_not(self, package: str, kind: Kind, base: str) -> str:
        bases = self._bases(package, kind)
        if bases:
            hint = near_miss(base, bases) or f"; it has {', '.join(bases[:8])}"
            return f"package '{package}' has no such {kind}{hint}"
        if package in shipped_packages() or self._folder(package) is not None:
            return f"package '{package}' has no {kind} at all"
        return f"there is no package '{package}'{self._near(package)}"

    def _near(self, package: str) -> str:
        return near_miss(package, self.packages()) or "; add its folder to ROSZ_PACKAGE_PATH"

    def _searched(self) -> list[str]:
        roots = self._packages.roots if self._packages is not None else ()
        return ["rosz", *map(str, roots)]

    def _folder(self, package: str) -> Path | None:
        if self._packages is None:
            return None
        try:
            return self._packages.find(package).path
        except PackageNotFound:
            return None

    def _bases(self, package: str, kind: Kind) -> list[str]:
        """List the types of a package without the package's name, sorted."""
        ours = set(_shipped(package, kind))
        return sorted(ours | {n.rpartition("/")[2] for n in self._folders.names(package, kind)})

    # Compiling.

    def _make(self, package: str, kind: Kind) -> ModuleType:
        shipped = _shipped(package, kind)
        more = self._own_names(package, kind)
        if not shipped and not more:
            raise TypeNotFound(f"{package}/{kind}", self._why_not(package, kind, ""))
        if not more:
            return import_module(f"rosz.msgs.{package}.{kind}")
        compiled = self._compile(package, kind, more)
        if shipped:
            ours = import_module(f"rosz.msgs.{package}.{kind}")
            for name in ours.__all__:
                setattr(compiled, name, getattr(ours, name))
            compiled.__all__ = tuple(sorted({*ours.__all__, *compiled.__all__}))  # type: ignore[attr-defined]
        return compiled

    def _compile(self, package: str, kind: Kind, names: list[str]) -> ModuleType:
        digest = hashlib.sha256(self._generation)
        for name in names:
            definition = self.definition(name)
            digest.update(f"\n{name} {len(definition.text)}\n{definition.text}".encode())
        stem = f"{package}_{kind}_{digest.hexdigest()[:32]}"
        module_name = f"rosz.msgs.{package}.{kind}" + ("_more" if _shipped(package, kind) else "")
        cached = self._load(module_name, stem)
        if cached is not None:
            return cached
        source = self._source(package, kind, names)
        file = self._keep(stem, source)
        if file is not None:
            return self._run(module_name, SourceFileLoader(module_name, str(file)))
        return self._run(module_name, _TextLoader(source, f"<{stem}>"))

    @cached_property
    def _generation(self) -> bytes:
        """Identify the generator and what its code calls."""
        digest = hashlib.sha256()
        for package in (rosz.idl, rosz.message):
            for folder in package.__path__:
                for file in sorted(Path(folder).glob("*.py")):
                    digest.update(file.read_bytes())
        return digest.digest()

    def _source(self, package: str, kind: Kind, names: list[str]) -> str:
        if kind == "msg":
            messages = [self._catalog.message(name) for name in names]
            return message_module(messages, self._catalog, _injected, package)
        services = [self._catalog.service(name) for name in names]
        return service_module(services, self._catalog, _injected, package)

    def _load(self, module_name: str, stem: str) -> ModuleType | None:
        """Return the module from the cache, if it is there and fits."""
        file = self._cache / f"{stem}.py" if self._cache is not None else None
        if file is None or not file.is_file():
            return None
        try:
            return self._run(module_name, SourceFileLoader(module_name, str(file)))
        except (_StaleError, OSError, SyntaxError, ImportError, EOFError, NameError):
            return None

    def _keep(self, stem: str, source: str) -> Path | None:
        """Write a source into the cache, whole or not at all: others may do so at the same time."""
        if self._cache is None:
            return None
        file = self._cache / f"{stem}.py"
        try:
            self._cache.mkdir(parents=True, exist_ok=True)
            with tempfile.NamedTemporaryFile(
                "w", encoding="utf-8", dir=self._cache, suffix=".tmp", delete=False
            ) as temporary:
                temporary.write(source)
            Path(temporary.name).replace(file)
        except OSError:
            return None  # a read-only home: the source stays in memory
        return file

    def _run(self, name: str, loader: SourceFileLoader | _TextLoader) -> ModuleType:
        spec = spec_from_loader(name, loader)
        if spec is None:
            raise ImportError(name)
        module = module_from_spec(spec)
        module.__dict__["_type_of"] = self._type_of
        loader.exec_module(module)
        return sys.modules.setdefault(name, module)  # where pickle looks for the classes

    def _type_of(self, name: str, type_hash: str, md5: str) -> type[Message]:
        """Return a class that a generated module builds on, if it is still the same."""
        cls = self.message(name)
        if (cls._type_hash, cls._md5sum) != (type_hash, md5):
            raise _StaleError(name)
        return cls


class _TextLoader(Loader):
    """Runs a source that has no file; tracebacks find its lines in ``linecache``."""

    def __init__(self, source: str, name: str) -> None:
        self._source = source
        self._name = name

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave the making of the module to the import system."""

    def exec_module(self, module: ModuleType) -> None:
        """Run the source in the module."""
        lines = self._source.splitlines(keepends=True)
        linecache.cache[self._name] = (len(self._source), None, lines, self._name)
        exec(compile(self._source, self._name, "exec"), module.__dict__)  # noqa: S102  # our own


def is_generated(file: str) -> bool:
    """Tell whether a file is a module that rosz generated."""
    try:
        with Path(file).open("rb") as opened:
            return opened.read(len(MARKER)) == MARKER.encode()
    except OSError:
        return False


def _injected(_name: str) -> None:
    """Tell the generator that the module gets its classes from ``_type_of``."""


def _shipped(package: str, kind: str) -> tuple[str, ...]:
    if package not in shipped_packages():
        return ()
    index = import_module(f"rosz.msgs.{package}")
    names: tuple[str, ...] = index.MESSAGES if kind == "msg" else index.SERVICES
    return names


def _is_shipped(name: str) -> bool:
    package, kind, base = name.split("/")
    return base in _shipped(package, kind)


def shipped_packages() -> frozenset[str]:
    """Return the names of the packages whose classes come with rosz."""
    return frozenset(
        entry.name
        for folder in rosz.msgs.__path__
        for entry in os.scandir(folder)
        if entry.is_dir() and not entry.name.startswith("_")
    )
