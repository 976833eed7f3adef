"""Types by name: the shipped classes, and those of any package on the package path.

A package that rosz does not ship is compiled whole, into a module like the shipped ones, when the
first of its types is requested. The generated source is cached for other processes. A type that is
on no package path is compiled from the text of its definition.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, TypeAlias

import rosz.idl
import rosz.message
import rosz.msgs
from rosz.errors import DefinitionError, PackageNotFound, TypeNotFound, near_miss
from rosz.idl import (
    Catalog,
    Definition,
    Folders,
    SourceCache,
    action_of,
    action_type,
    class_name,
    full_name,
    identity,
    is_service,
    is_service_message,
    split_definitions,
)
from rosz.idl.generate import MARKER, generate, module_source, shipped_module
from rosz.message import Action, Message, Service
from rosz.names import check_length
from rosz.packages import PackageIndex

__all__ = ("Kind", "TypeStore", "is_generated", "shipped_packages", "shipped_types")

Kind: TypeAlias = Literal["msg", "srv", "action"]
_KINDS: tuple[Kind, ...] = ("msg", "srv", "action")
_BASES: dict[Kind, type] = {"msg": Message, "srv": Service, "action": Action}

_BUILT_IN = frozenset(
    {"builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration", "std_msgs/msg/Header"}
)
"""Types that ROS 1 writes in another way; their classes are always the shipped ones."""
_NAME = re.compile(r"([A-Za-z]\w*)/(?:(msg|srv|action)/)?([A-Za-z]\w*)", re.ASCII)


class _StaleError(Exception):
    """A cached module was generated with another definition of a type in it."""


class TypeStore:
    """Message, service and action classes by name.

    Args:
        packages: Index of packages besides those that rosz ships, which come first so that their
            types stay those of ROS 2.
        cache: Folder for generated sources; None to keep them in memory only.
    """

    def __init__(self, packages: PackageIndex | None = None, cache: Path | None = None) -> None:
        self._packages = packages
        self._compiler = _ModuleCompiler(cache)
        self._modules: dict[tuple[str, Kind], ModuleType] = {}
        self._folders = Folders(self._folder)
        self._catalog = Catalog(self.definition)

    def message(self, name: str) -> type[Message]:
        """Return a message class.

        Args:
            name: ``std_msgs/String`` or ``std_msgs/msg/String``; a message of an action is
                ``example_interfaces/action/Fibonacci_FeedbackMessage``.

        Raises:
            TypeNotFound: The type does not exist.
            DefinitionError: The type or one in it is not well-formed.
        """
        cls: type[Message] = self._class(name, "msg")
        return cls

    def service(self, name: str) -> type[Service]:
        """Return a service class.

        Args:
            name: ``std_srvs/SetBool`` or ``std_srvs/srv/SetBool``; a service of an action is
                ``example_interfaces/action/Fibonacci_SendGoal``.

        Raises:
            TypeNotFound: The type does not exist.
            DefinitionError: The type or one in it is not well-formed.
        """
        cls: type[Service] = self._class(name, "srv")
        return cls

    def action(self, name: str) -> type[Action]:
        """Return an action class.

        Args:
            name: ``example_interfaces/Fibonacci`` or ``example_interfaces/action/Fibonacci``.

        Raises:
            TypeNotFound: The type does not exist.
            DefinitionError: The type or one in it is not well-formed.
        """
        cls: type[Action] = self._class(name, "action")
        return cls

    def message_from_text(
        self, name: str, text: str, others: Mapping[str, str] | None = None
    ) -> type[Message]:
        """Return a message class by the text of its definition.

        It is the class that this store has by that name if the definitions are equal. Types in the
        definition are those of the texts, or else those of this store.

        Args:
            name: ``std_msgs/String`` or ``std_msgs/msg/String``.
            text: Text of the definition. Texts of the types in it may follow, each behind a line of
                ``=`` and a line ``MSG: package/Name``, as in ROS 1's full texts and in bags.
            others: Texts of types in the definition by name, as ROS 2's get_type_description
                returns them.

        Raises:
            TypeNotFound: The name is not that of a message type.
            DefinitionError: A definition is not well-formed, or a type in it does not exist.
        """
        cls: type[Message] = self._from_text(self._check_name(name, "msg"), text, others)
        return cls

    def service_from_text(
        self, name: str, text: str, others: Mapping[str, str] | None = None
    ) -> type[Service]:
        """Return a service class by the text of its definition; see `message_from_text`.

        Args:
            name: ``std_srvs/SetBool`` or ``std_srvs/srv/SetBool``.
            text: Text of the definition, which those of types in it may follow.
            others: Texts of types in the definition by name.

        Raises:
            TypeNotFound: The name is not that of a service type.
            DefinitionError: A definition is not well-formed, or a type in it does not exist.
        """
        cls: type[Service] = self._from_text(self._check_name(name, "srv"), text, others)
        return cls

    def action_from_text(self, name: str, text: str, others: Mapping[str, str]) -> type[Action]:
        """Return an action class by the text of its definition; see `message_from_text`.

        Args:
            name: ``example_interfaces/Fibonacci`` or ``example_interfaces/action/Fibonacci``.
            text: Text of the definition.
            others: Texts of types in the definition by name.

        Raises:
            TypeNotFound: The name is not that of an action type.
            DefinitionError: A definition is not well-formed, or a type in it does not exist.
        """
        full = self._check_name(name, "action")
        texts = {full_name(other, "msg"): body for other, body in others.items()}
        return _TextTypes(self, self._compiler, {full: text, **texts}).action(full)

    def names(self, kind: Kind, package: str | None = None) -> list[str]:
        """Return the names of all types of a kind, as ``std_msgs/String``, sorted.

        Args:
            kind: ``msg``, ``srv`` or ``action``.
            package: Package that the types belong to; any when not given.

        Raises:
            PackageNotFound: The package does not exist.
        """
        if package is not None:
            if package not in self.packages():
                raise PackageNotFound(package, self.packages(), self._searched())
            return [f"{package}/{base}" for base in self._bases(package, kind)]
        return [f"{each}/{base}" for each in self.packages() for base in self._bases(each, kind)]

    def packages(self, kind: Kind | None = None) -> list[str]:
        """Return the names of all packages that have types, or types of one kind, sorted."""
        names = set(shipped_packages())
        if self._packages is not None:
            names |= set(self._packages.names())
        kinds = _KINDS if kind is None else (kind,)
        return sorted(p for p in names if any(self._bases(p, each) for each in kinds))

    def has(self, package: str, kind: Kind) -> bool:
        """Return whether a package has types of a kind."""
        return bool(shipped_types(package, kind) or self._folders.names(package, kind))

    def definition(self, name: str) -> Definition:
        """Return the definition of a type.

        Args:
            name: Full name, ``std_msgs/msg/String`` or ``std_srvs/srv/SetBool``, or that of an
                action or of what ROS 2 makes of it.

        Raises:
            TypeNotFound: The type does not exist.
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

        A type that is not well-formed is not in it; to get it from there raises DefinitionError.

        Raises:
            TypeNotFound: The package has none.
            DefinitionError: None of them is well-formed.
        """
        key = package, kind
        if key not in self._modules:
            self._modules.setdefault(key, self._make(package, kind))
        return self._modules[key]

    def sources(self, packages: Sequence[str]) -> dict[str, dict[str, str]]:
        """Return sources of importable modules for packages, and for those that they depend on.

        Types that rosz ships are imported from there.

        Args:
            packages: Names of packages on the package path.

        Returns:
            Sources by package and file name; the packages' folders belong side by side in a folder
            on Python's path.

        Raises:
            PackageNotFound: The package does not exist.
            TypeNotFound: A package has no types of its own.
            DefinitionError: A definition is not well-formed, or a type in it does not exist.
        """
        done: dict[str, dict[str, str]] = {}
        rest = list(packages)
        while rest:
            package = rest.pop(0)
            if package in done:
                continue
            types: dict[str, list[str]] = {kind: self._own_names(package, kind) for kind in _KINDS}
            if self._folder(package) is None:
                raise PackageNotFound(package, self.packages(), self._searched())
            if not any(types.values()):
                raise TypeNotFound(package, f"package '{package}' has no types of its own")
            done[package] = generate(package, types, self._catalog, self._place)
            names = [name for own in types.values() for name in own]
            specs = [part for name in names for part in self._catalog.parts(name)]
            below = {name for spec in specs for name in self._catalog.below(spec)}
            rest += sorted({name.partition("/")[0] for name in below if not _is_shipped(name)})
        return done

    def _place(self, name: str) -> str:
        """Return the module that generated code imports a class from."""
        package, kind, _ = name.split("/")
        return shipped_module(name) if _is_shipped(name) else f"{package}.{kind}"

    def _own_names(self, package: str, kind: str) -> list[str]:
        """Return the full names of a package's types that rosz does not ship."""
        return [name for name in self._folders.names(package, kind) if not _is_shipped(name)]

    def _class(self, name: str, kind: Kind) -> Any:
        full = self._check_name(name, kind)
        place: Kind
        package, place, base = full.split("/")  # type: ignore[assignment]
        if _is_shipped(full):
            cls = getattr(import_module(shipped_module(full)), base)
        elif _file_of(place, base) in self._bases(package, place):
            cls = getattr(self.module(package, place), base)
        else:
            raise TypeNotFound(name, self._why_not(package, place, base))
        if not issubclass(cls, _BASES[kind]):
            raise TypeNotFound(name, f"it is not the name of a {kind}")
        return cls

    def _check_name(self, name: str, kind: Kind) -> str:
        """Return the full name of a type of a kind, or of one made of an action or a service."""
        match = _NAME.fullmatch(check_length(name))
        if match is not None:
            full = f"{match[1]}/{match[2] or kind}/{match[3]}"
            place = "msg" if is_service_message(full) else match[2]
            if place in (None, kind, "action"):
                return full
        raise TypeNotFound(name, f"expected a name such as 'package/Type' of a {kind}")

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
        """Return the types of a package without the package's name, sorted."""
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
            names = {*ours.__all__, *getattr(compiled, "__all__", ())}
            compiled.__all__ = tuple(sorted(names))  # type: ignore[attr-defined]
        return compiled

    def _from_text(self, name: str, text: str, others: Mapping[str, str] | None) -> Any:
        texts = {full_name(other, "msg"): body for other, body in (others or {}).items()}
        texts |= split_definitions(name, text)
        return _TextTypes(self, self._compiler, texts).find(name)

    def _compile(self, package: str, kind: Kind, names: list[str]) -> ModuleType:
        """Return the module of types; those that are not well-formed fail when they are used."""
        try:
            return self._load(package, kind, names)
        except DefinitionError:
            sound = list(filter(self._is_sound, names))
            if not sound and not shipped_types(package, kind):
                raise
        module = self._load(package, kind, sound) if sound else ModuleType(f"{package}.{kind}")

        def missing(base: str) -> Any:
            """Raise the error of a type that the module lacks."""
            whole = f"{package}/{kind}/{_file_of(kind, base)}"
            if whole in names:
                self._catalog.parts(whole)
            raise AttributeError(f"module '{package}.{kind}' has no attribute '{base}'")

        module.__dict__["__getattr__"] = missing
        return module

    def _is_sound(self, name: str) -> bool:
        try:
            self._catalog.parts(name)
        except DefinitionError:
            return False
        return True

    def _load(self, package: str, kind: Kind, names: list[str]) -> ModuleType:
        definitions = [(name, self.definition(name).text) for name in names]
        stem = f"{package}_{kind}_{self._compiler.digest(definitions)}"
        more = "_more" if shipped_types(package, kind) else ""
        return self._compiler.load(
            f"rosz.msgs.{package}.{kind}{more}",
            stem,
            [name.rpartition("/")[2] for name in names],
            self.message,
            lambda: module_source(names, self._catalog, _injected),
        )


class _ModuleCompiler:
    """Generates modules of classes, and runs them."""

    def __init__(self, cache: Path | None) -> None:
        self._cache = SourceCache(cache)

    def digest(self, definitions: Iterable[tuple[str, str]]) -> str:
        """Return a name for the source that is generated from definitions (name, text)."""
        import hashlib  # with OpenSSL, which takes memory that few nodes need

        digest = hashlib.sha256(self._generation)
        for name, text in definitions:
            digest.update(f"\n{name} {len(text)}\n{text}".encode())
        return digest.hexdigest()[:32]

    def load(
        self,
        module_name: str,
        stem: str,
        members: list[str],
        message: Callable[[str], type[Message]],
        write: Callable[[], str],
    ) -> ModuleType:
        """Return a generated module: a loaded or a cached one, or a new one.

        Args:
            module_name: Name of the module, where pickle looks for the classes.
            stem: Name of the source in the cache.
            members: Names that the module must have.
            message: Function that returns the class of a message type in the definitions.
            write: Function that generates the source.
        """
        loaded = sys.modules.get(module_name)
        stem_known, needs_known = getattr(loaded, "_made_of", ("", {}))
        same = stem_known == stem and all(message(n) is cls for n, cls in needs_known.items())
        if loaded is not None and same:
            return loaded
        needs: dict[str, type[Message]] = {}

        def type_of(name: str, type_hash: str, md5: str) -> type[Message]:
            """Return a class that the module builds on, if it is still the same."""
            cls = needs[name] = message(name)
            if (cls._type_hash, cls._md5sum) != (type_hash, md5):
                raise _StaleError(name)
            return cls

        namespace = {"_type_of": type_of, "_made_of": (stem, needs)}
        module = self._cache.load(module_name, stem, namespace, members, write)
        sys.modules.setdefault(module_name, module)
        return module

    @cached_property
    def _generation(self) -> bytes:
        """A hash of the generator and of the functions that generated code calls."""
        import hashlib

        digest = hashlib.sha256()
        for package in (rosz.idl, rosz.message):
            for folder in package.__path__:
                for file in sorted(Path(folder).glob("*.py")):
                    digest.update(file.read_bytes())
        return digest.digest()


class _TextTypes:
    """Types whose definitions are given as texts.

    Each is compiled into a module of its own, since types of one name may come with several
    definitions.
    """

    def __init__(self, store: TypeStore, compiler: _ModuleCompiler, texts: dict[str, str]) -> None:
        self._store = store
        self._compiler = compiler
        self._texts = texts
        self._catalog = Catalog(self._find)

    def _find(self, name: str) -> Definition:
        if name in self._texts and name not in _BUILT_IN:
            return Definition(self._texts[name], f"<{name}>")
        package, kind, base = name.split("/")
        action = f"{package}/{kind}/{_file_of(kind, base)}"
        if action != name and action in self._texts:
            made = action_type(action, self._find(action), base)
            if made is not None:
                return made
        return self._store.definition(name)

    def action(self, name: str) -> type[Action]:
        """Return an action class."""
        cls: type[Action] = self._compile(name, self._all_texts(name))
        return cls

    def find(self, name: str) -> Any:
        """Return a message or service class; the store's own if its definition is the same."""
        wanted = identity(name, self._catalog)
        look = self._store.service if is_service(name) else self._store.message
        try:
            cls = look(name)
        except (TypeNotFound, DefinitionError):
            cls = None
        if cls is not None and (cls._type_hash, cls._md5sum) == wanted:
            return cls
        return self._compile(name, self._all_texts(name))

    def _all_texts(self, name: str) -> dict[str, str]:
        """Return the texts of a type and of all types in it, by name."""
        texts = {name: self._find(name).text}
        for part in self._catalog.parts(name):
            texts |= {spec.name: spec.text for spec in self._catalog.below(part).values()}
        return texts

    def _compile(self, name: str, texts: dict[str, str]) -> Any:
        package, kind, base = name.split("/")
        stem = f"{package}_{kind}_{base}_{self._compiler.digest(sorted(texts.items()))}"
        module = self._compiler.load(
            f"rosz.msgs.{package}.{kind}.{stem}",
            stem,
            [class_name(name)],
            self.find,
            lambda: module_source([name], self._catalog, _injected),
        )
        return getattr(module, class_name(name))


def is_generated(file: str) -> bool:
    """Return whether a file is a module that rosz generated."""
    try:
        with Path(file).open("rb") as opened:
            return opened.read(len(MARKER)) == MARKER.encode()
    except OSError:
        return False


def _injected(_name: str) -> None:
    """Return None: the module gets its classes from ``_type_of``."""


def shipped_types(package: str, kind: str) -> tuple[str, ...]:
    """Return the names of the types of a kind that come with rosz, without the package's name."""
    if package not in shipped_packages():
        return ()
    index = import_module(f"rosz.msgs.{package}")
    kinds = {"msg": index.MESSAGES, "srv": index.SERVICES, "action": index.ACTIONS}
    names: tuple[str, ...] = kinds[kind]
    return names


def _is_shipped(name: str) -> bool:
    package, kind, base = name.split("/")
    return _file_of(kind, base) in shipped_types(package, kind)


def _file_of(kind: str, base: str) -> str:
    """Return the name of the definition that a type is made of: that of its action, or its own."""
    return action_of(base) if kind == "action" else base


def shipped_packages() -> frozenset[str]:
    """Return the names of the packages whose classes come with rosz."""
    return frozenset(
        entry.name
        for folder in rosz.msgs.__path__
        for entry in os.scandir(folder)
        if entry.is_dir() and not entry.name.startswith("_")
    )
