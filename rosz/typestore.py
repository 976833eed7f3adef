"""Types by name: the shipped classes, and those of any package on the package path.

A package that rosz does not ship is compiled when the first of its types is asked for, whole, into
a module like the shipped ones. The generated source is kept in a cache folder under a name made of
what it was generated from, so that other processes need not generate it again; tracebacks show its
lines. Where the folder cannot be written, the source lives in memory only.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
from collections.abc import Sequence
from functools import cached_property
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, TypeAlias

import rosz.idl
import rosz.message
import rosz.msgs
from rosz.errors import PackageNotFound, TypeNotFound, near_miss
from rosz.idl import Catalog, Definition, Folders
from rosz.idl.cache import SourceCache
from rosz.idl.generate import (
    MARKER,
    generate,
    message_module,
    service_module,
    shipped_module,
)
from rosz.message import Message, Service
from rosz.packages import PackageIndex

__all__ = ("Kind", "TypeStore", "is_generated", "shipped_packages", "shipped_types")

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
        self._cache = SourceCache(cache)
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
        return bool(shipped_types(package, kind) or self._folders.names(package, kind))

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
        if base in shipped_types(package, kind):
            return getattr(import_module(shipped_module(f"{package}/{kind}/{base}")), base)
        if base not in self._bases(package, kind):
            raise TypeNotFound(name, self._why_not(package, kind, base))
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
        ours = set(shipped_types(package, kind))
        return sorted(ours | {n.rpartition("/")[2] for n in self._folders.names(package, kind)})

    # Compiling.

    def _make(self, package: str, kind: Kind) -> ModuleType:
        shipped = shipped_types(package, kind)
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
        module_name = f"rosz.msgs.{package}.{kind}" + (
            "_more" if shipped_types(package, kind) else ""
        )
        known = sys.modules.get(module_name)
        if known is not None and self._fits(known, stem):
            return known
        needs: dict[str, type[Message]] = {}

        def type_of(name: str, type_hash: str, md5: str) -> type[Message]:
            """Give the module a class that it builds on, if it is still the same."""
            cls = needs[name] = self.message(name)
            if (cls._type_hash, cls._md5sum) != (type_hash, md5):
                raise _StaleError(name)
            return cls

        namespace = {"_type_of": type_of, "_made_of": (stem, needs)}
        bases = [name.rpartition("/")[2] for name in names]
        module = self._cache.load(module_name, stem, namespace, bases)
        if module is None:
            source = self._source(package, kind, names)
            module = self._cache.add(module_name, stem, namespace, source)
        sys.modules.setdefault(module_name, module)  # where pickle looks for the classes
        return module

    def _fits(self, module: ModuleType, stem: str) -> bool:
        """Tell whether a module that another store compiled is what this one would compile."""
        made = getattr(module, "_made_of", None)
        if made is None or made[0] != stem:
            return False
        return all(self.message(name) is cls for name, cls in made[1].items())

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


def is_generated(file: str) -> bool:
    """Tell whether a file is a module that rosz generated."""
    try:
        with Path(file).open("rb") as opened:
            return opened.read(len(MARKER)) == MARKER.encode()
    except OSError:
        return False


def _injected(_name: str) -> None:
    """Tell the generator that the module gets its classes from ``_type_of``."""


def shipped_types(package: str, kind: str) -> tuple[str, ...]:
    """Return the names of the types of a kind that come with rosz, without the package's name."""
    if package not in shipped_packages():
        return ()
    index = import_module(f"rosz.msgs.{package}")
    names: tuple[str, ...] = index.MESSAGES if kind == "msg" else index.SERVICES
    return names


def _is_shipped(name: str) -> bool:
    package, kind, base = name.split("/")
    return base in shipped_types(package, kind)


def shipped_packages() -> frozenset[str]:
    """Return the names of the packages whose classes come with rosz."""
    return frozenset(
        entry.name
        for folder in rosz.msgs.__path__
        for entry in os.scandir(folder)
        if entry.is_dir() and not entry.name.startswith("_")
    )
