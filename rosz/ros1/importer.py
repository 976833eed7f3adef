"""Makes ROS 1's Python modules and message packages importable.

It adds two finders to ``sys.meta_path``. The first one stands in front and finds rosz's own modules
(``std_msgs``, ``rospy``, …), and ``<package>.msg``, ``<package>.srv`` and ``<package>.cfg`` of any
package on the package path. The second one stands at the end and finds packages that nothing else
provides; only it searches the package path for a plain name. It finds the Python modules that
packages offer (`python_setup`), with their messages in them as in catkin's devel space.

A module of rosz is the same object as rosz's own: ``std_msgs.msg`` is ``rosz.msgs.std_msgs.msg``.

As with genpy, ``from <package>.msg import *`` binds more than the types. Each module that genpy
generates imports ``genpy``, ``struct``, ``sys``, ``codecs`` and the packages of the types in a
definition, and has no ``__all__``. Programs have come to use these names without an import of their
own: ``sys.argv``, ``geometry_msgs.msg.Point()``.
"""

from __future__ import annotations

import builtins
import codecs
import copy  # noqa: F401  # tries to import Jython's "org", which must not be searched for
import re
import struct
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import cache, cached_property
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import find_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from rosz.environment import Environment, package_index
from rosz.errors import PackageError, RoszError
from rosz.interrupts import InterruptDeferral
from rosz.message import Message, Ros2Default, Service
from rosz.packages import PackageIndex
from rosz.replacements import instead_of
from rosz.ros1 import modules
from rosz.typestore import Kind, TypeStore, is_generated, shipped_packages, shipped_types

if TYPE_CHECKING:
    from rosz.ros1.python_setup import Offers

_KINDS: dict[str, Kind] = {"msg": "msg", "srv": "srv", "action": "action"}
_CFG = "cfg"
_MESSAGES_ALONE = ("_msgs", "_srvs", "_interfaces")
_RCLPY = "rclpy"
_plain_build = builtins.__build_class__


# Programs derive classes from messages, as in ``class Wrapper(DiagnosticStatus)``. Such a statement
# takes the metaclass of its bases, and that of messages refuses ``__init__``. Nothing less helps:
# ``__init_subclass__`` is called after the refusal. A metaclass of messages that does not refuse,
# even without a ``__call__``, triples the time that they take to make with keywords in Python 3.11,
# where a class made by Python code does not inherit the vectorcall of its base. A ``__builtins__``
# of their own for the modules that rosz loads would miss those that Python finds on ``sys.path``.
def _build_class(body: Any, name: str, /, *bases: Any, **options: Any) -> Any:
    """Run a class statement; one that derives from messages gets a metaclass for that."""
    if "metaclass" not in options and any(getattr(base, "_schema", None) for base in bases):
        from rosz.message import Derived

        options["metaclass"] = Derived
    return _plain_build(body, name, *bases, **options)


def install(store: TypeStore | None = None, packages: PackageIndex | None = None) -> None:
    """Make ROS 1's names importable in this process; again does nothing.

    Args:
        store: Store of message classes; by the environment of the process when not given.
        packages: Packages to search; by the environment of the process when not given.
    """
    if any(isinstance(finder, _FrontFinder) for finder in sys.meta_path):
        return
    builtins.__build_class__ = _build_class
    types = _Types(store, packages)
    sys.meta_path.insert(0, _FrontFinder(types))
    sys.meta_path.append(_EndFinder(types))


def uninstall() -> None:
    """Remove the finders; modules that are imported stay."""
    sys.meta_path[:] = [
        finder for finder in sys.meta_path if not isinstance(finder, _FrontFinder | _EndFinder)
    ]


def type_store() -> TypeStore:
    """Return the store of the message classes that imports return."""
    return _types().store


def package_path() -> PackageIndex:
    """Return the packages that imports search."""
    return _types().packages


def _types() -> _Types:
    install()
    return next(finder.types for finder in sys.meta_path if isinstance(finder, _FrontFinder))


class _Types:
    """Packages and their types, read when they are needed."""

    def __init__(self, store: TypeStore | None, packages: PackageIndex | None) -> None:
        if store is not None:
            self.store = store
        if packages is not None:
            self.packages = packages

    @cached_property
    def _environment(self) -> Environment:
        return Environment.read()

    @cached_property
    def packages(self) -> PackageIndex:
        return package_index(self._environment)

    @cached_property
    def _cache(self) -> Path:
        return self._environment.home / "rosz"

    @cached_property
    def store(self) -> TypeStore:
        return TypeStore(self.packages, self._cache)

    @cached_property
    def offers(self) -> Offers:
        from rosz.ros1.python_setup import Offers

        return Offers(self.packages, self._cache / "modules.json")

    def shipped(self, package: str, kind: Kind) -> ModuleType:
        """Return a shipped module; types that it lacks come from a package of the same name."""
        if not shipped_types(package, kind):
            return self.store.module(package, kind)
        module = import_module(f"rosz.msgs.{package}.{kind}")

        def more(name: str) -> object:
            whole = module
            if not name.startswith("_"):
                with suppress(PackageError):  # of an unrelated package
                    whole = self.store.module(package, kind)
            if whole is module:
                raise AttributeError(f"module '{package}.{kind}' has no attribute '{name}'")
            return getattr(whole, name)

        module.__dict__.setdefault("__getattr__", more)
        return module

    def cfg_files(self, package: str) -> list[Path]:
        from rosz.ros1.client.dynamic_reconfigure import find_files

        try:
            return find_files(self.packages.find(package).path)
        except RoszError:  # a broken package must not break other imports
            return []

    def folder(self, package: str) -> Path | None:
        """Return the folder of a package that has types or dynamic_reconfigure files."""
        try:
            has_types = any(self.store.has(package, kind) for kind in _KINDS.values())
            return (
                self.packages.find(package).path if has_types or self.cfg_files(package) else None
            )
        except RoszError:  # a broken package must not break other imports
            return None


class _AliasLoader(Loader):
    """Loads a module that exists under another name."""

    def __init__(self, load: Callable[[], ModuleType]) -> None:
        self._load = load
        self._name = ""
        self._spec: ModuleSpec | None = None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        with InterruptDeferral():
            module = self._load()
        self._name, self._spec = spec.name, module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Add submodules; the module has been executed under its own name."""
        module.__spec__ = self._spec or module.__spec__
        modules.add_submodules(self._name)


def _alias(name: str, load: Callable[[], ModuleType]) -> ModuleSpec:
    return ModuleSpec(name, _AliasLoader(load), is_package=True)


def _loaded(name: str, load: Callable[[], ModuleType]) -> ModuleType:
    """Load a module of rosz; if it needs an extra, the error names that."""
    try:
        module = load()
    except ModuleNotFoundError as error:
        module_of = modules.MODULES.get(name.partition(".")[0], modules.Module())
        extra = module_of.extras.get(error.name or "")
        if extra is None:
            raise
        text = f"{error}; {name} needs it, run: pip install 'rosz[{extra}]'"
        raise ModuleNotFoundError(text, name=error.name) from error
    modules.list_exports(module)
    modules.explain_missing(name, module)
    return module


class _FrontFinder(MetaPathFinder):
    def __init__(self, types: _Types) -> None:
        self.types = types
        self._shipped = shipped_packages()

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: ModuleType | None = None,  # noqa: ARG002
    ) -> ModuleSpec | None:
        """Find a module that rosz ships or compiles."""
        root, _, rest = fullname.partition(".")
        if root == "rosz":
            # ``from sensor_msgs import point_cloud2`` looks below the module's own name.
            alias = fullname.removeprefix("rosz.msgs.")
            if "." in alias and modules.MODULES.get(alias, modules.Module()).home:
                return self._of_rosz(alias, alias)
            return self._compiled(fullname)
        spec = self._of_ros(fullname, root, rest, path)
        if spec is not None:
            Ros2Default.ros1 = root != _RCLPY and _RCLPY not in sys.modules
        return spec

    def _of_ros(
        self, fullname: str, root: str, rest: str, path: Sequence[str] | None
    ) -> ModuleSpec | None:
        first, _, inner = rest.partition(".")
        kind = _KINDS.get(first) if fullname not in modules.MODULES else None
        if kind == "action" and not self.types.store.has(root, kind):
            kind = None  # such as rclpy.action
        if kind is not None:
            return self._of_package(fullname, root, kind, inner, path)
        if first == _CFG:
            return self._of_cfg(fullname, root, inner, path)
        if self._is_hidden(root):
            # It comes before one that is installed, as catkin's devel space does.
            return _EndFinder(self.types).find_spec(fullname, path) if path is None else None
        if root in modules.MODULES or fullname in modules.MODULES:
            return self._of_rosz(fullname, root)
        if root in self._shipped and not rest:
            return _alias(fullname, lambda: self._of_messages(root))
        return None

    def _is_hidden(self, root: str) -> bool:
        """Return whether a package of the user hides the one that rosz ships.

        Clients of the network, such as rospy and actionlib, are always those of rosz. Packages of
        messages alone are not searched for code, since that takes time.
        """
        may_be = root in modules.HIDEABLE or (
            root in self._shipped
            and root not in modules.MODULES
            and not root.endswith(_MESSAGES_ALONE)
        )
        return may_be and self.types.offers.find(root) is not None

    def _of_messages(self, package: str) -> ModuleType:
        """Return the module of a shipped package; its modules of types load when they are used.

        In ROS 1 ``import std_msgs`` is enough for ``std_msgs.msg``, which rospy has imported.
        """
        module = import_module(f"rosz.msgs.{package}")
        homes = {
            kind: f"{package}.{kind}" for kind in _KINDS if shipped_types(package, _KINDS[kind])
        }
        vars(module).setdefault("__getattr__", modules.attribute(package, module, homes))
        return module

    def _of_rosz(self, name: str, root: str) -> ModuleSpec | None:
        """Find ``rospy`` or one of its submodules; importing it may need an extra."""
        module = modules.MODULES.get(name)
        if module is not None and not module.home:
            return _alias(name, lambda: _loaded(name, lambda: modules.submodule(name)))
        below = module.home if module else modules.MODULES[root].home + name.removeprefix(root)
        own = f"rosz.{below}"
        try:
            exists = own in sys.modules or find_spec(own) is not None
        except ModuleNotFoundError:  # a plain module has no submodules
            exists = False
        return _alias(name, lambda: _loaded(name, lambda: import_module(own))) if exists else None

    def _compiled(self, name: str) -> ModuleSpec | None:
        """Find ``rosz.msgs.<package>`` of a package that is compiled, for pickle."""
        parts = name.split(".")
        if parts[:2] != ["rosz", "msgs"] or len(parts) == 2 or parts[2] in self._shipped:  # noqa: PLR2004
            return None
        package = parts[2]
        if len(parts) == 3 and self.types.folder(package) is not None:  # noqa: PLR2004
            return ModuleSpec(name, None, is_package=True)
        kind = _KINDS.get(parts[3]) if len(parts) == 4 else None  # noqa: PLR2004
        if kind is None or not self.types.store.has(package, kind):
            return None
        return _alias(name, lambda: self.types.store.module(package, kind))

    def _of_package(
        self, name: str, package: str, kind: Kind, inner: str, path: Sequence[str] | None
    ) -> ModuleSpec | None:
        """Find ``<package>.msg``, ``<package>.msg._Type`` (genpy's), or ``._type`` (ROS 2's)."""
        if not self.types.store.has(package, kind):
            return None
        if not inner:
            generated = PathFinder.find_spec(name, path) if package not in self._shipped else None
            # catkin makes no module of actions, so a package may have one of its own.
            own = kind == "action"
            origin = generated.origin if generated is not None else None
            if origin and (own or is_generated(origin)):
                return generated
            return _alias(name, lambda: self._module(package, kind))
        module = import_module(f"{package}.{kind}")
        types = (each for each in module.__all__ if inner in {f"_{each}", f"_{_snake_case(each)}"})
        type_name = next(types, None)
        return _alias(name, lambda: _single(name, module, type_name)) if type_name else None

    def _module(self, package: str, kind: Kind) -> ModuleType:
        shipped = package in self._shipped
        types = self.types
        module = types.shipped(package, kind) if shipped else types.store.module(package, kind)
        return module if kind == "action" else _add_names(module)

    def _of_cfg(
        self, name: str, package: str, inner: str, path: Sequence[str] | None
    ) -> ModuleSpec | None:
        """Find ``<package>.cfg``, or ``<package>.cfg.<Name>Config`` as catkin generates it."""
        files = self.types.cfg_files(package)
        if not files:
            return None
        if inner:
            from rosz.ros1.client.dynamic_reconfigure.cfgfile import load

            return _alias(name, lambda: load(name, files)) if inner.endswith("Config") else None
        generated = PathFinder.find_spec(name, path)
        spec = ModuleSpec(name, None, is_package=True)
        spec.submodule_search_locations = [
            *((generated and generated.submodule_search_locations) or ())
        ]
        return spec


class _EndFinder(MetaPathFinder):
    def __init__(self, types: _Types) -> None:
        self._types = types
        self._shipped = shipped_packages()

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: ModuleType | None = None,  # noqa: ARG002
    ) -> ModuleSpec | None:
        """Find a module of a package on the package path.

        Raises:
            ModuleNotFoundError: ROS has such a module and rosz has not; it names a replacement.
        """
        root, _, rest = fullname.partition(".")
        # Python's library tries modules of other systems while modules that are needed here load.
        if root in sys.stdlib_module_names:
            return None
        spec = None
        if path is None and not rest:
            spec = self._of_package(fullname)
        elif root in self._shipped and "." not in rest:
            code = self._types.offers.find(root)
            spec = PathFinder.find_spec(fullname, [str(code)]) if code is not None else None
        if spec is not None:
            return spec
        if fullname == "ros":  # a file or a package of the user's with this name hides it
            return _alias(fullname, _all_modules)
        instead = instead_of(fullname)
        if instead:
            text = f"No module named '{fullname}': rosz does not have it: {instead}"
            raise ModuleNotFoundError(text, name=fullname)
        return None

    def _of_package(self, name: str) -> ModuleSpec | None:
        """Find the Python code of a package, its types, or both."""
        code = self._types.offers.find(name)
        types = self._types.folder(name)
        if code is not None:
            whole = code.suffix != ".py"
            file = code / "__init__.py" if whole else code
            return spec_from_file_location(
                name,
                file,
                loader=_CodeLoader(name, str(file)),
                submodule_search_locations=[str(code)] if whole else [] if types else None,
            )
        if types is None:
            return None
        spec = ModuleSpec(name, None, is_package=True)
        code = types / "src" / name
        spec.submodule_search_locations = [str(code)] if code.is_dir() else []
        return spec


class _CodeLoader(SourceFileLoader):
    """Loads a module of a package.

    As in catkin's devel space, the folder that it lies in goes on ``sys.path`` first, since modules
    import others that lie beside them.
    """

    def exec_module(self, module: ModuleType) -> None:
        file = Path(self.path)
        folder = str((file.parent if file.name == "__init__.py" else file).parent)
        if folder not in sys.path:
            sys.path.insert(0, folder)
        super().exec_module(module)


def _all_modules() -> ModuleType:
    """Return ``ros``, in which roslib has other modules: ``from ros import rospy``."""

    def find(name: str) -> ModuleType:
        try:
            return import_module(name)
        except ModuleNotFoundError as error:
            if error.name != name:
                raise
            text = f"module 'ros' has no attribute '{name}': {error}"
            raise AttributeError(text, name=name) from error

    module = ModuleType("ros")
    vars(module)["__getattr__"] = find
    return module


def _single(name: str, module: ModuleType, type_name: str) -> ModuleType:
    """Return a module with one type, and with the messages of a service or action."""
    single = ModuleType(name)
    whole = getattr(module, type_name)
    setattr(single, type_name, whole)
    for part, cls in vars(whole).items():
        if isinstance(cls, type) and not part.startswith("_"):
            setattr(single, f"{type_name}{part}", cls)
            setattr(single, f"{type_name}_{part}", cls)
    return single


def _snake_case(name: str) -> str:
    """Return the name of the module of a type in ROS 2: ``skeleton3_d`` for ``Skeleton3D``."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=.)(?=[A-Z][a-z])", "_", name).lower()


_PLAIN = {"codecs": codecs, "python3": True, "struct": struct, "sys": sys}


class _Genpy(ModuleType):
    """genpy, imported at its first use, since it takes longer than the messages."""

    def __getattr__(self, name: str) -> Any:
        return getattr(import_module("genpy"), name)


def _add_names(module: ModuleType) -> ModuleType:
    """Add genpy's names to a module of messages or services, and return it; again does nothing.

    Packages are imported when they are asked for.
    """
    names = vars(module)
    types = names.get("__all__", ())
    if "python3" in types:
        return module
    for name, value in _PLAIN.items():
        names.setdefault(name, value)
    packages = {package for each in types if each in names for package in _packages_in(names[each])}
    before = names.get("__getattr__")

    def find(name: str) -> Any:
        if name == "genpy":
            return sys.modules.get(name) or _Genpy(name)
        if name in packages:
            return import_module(f"{name}.msg") and sys.modules[name]
        if before is None:
            raise AttributeError(f"module '{module.__name__}' has no attribute '{name}'")
        return before(name)

    names["__getattr__"] = find
    names["__all__"] = tuple(sorted({*types, *_PLAIN, *packages, "genpy"}))
    return module


def _packages_in(kind: Any) -> Iterator[str]:
    """Yield the packages of the messages in a type, at any depth."""
    parts = (kind.Request, kind.Response) if issubclass(kind, Service) else (kind,)
    for part in parts:
        yield from _below(part)


@cache
def _below(cls: Any) -> frozenset[str]:
    packages: set[str] = set()
    for _, kind, _ in cls._schema:
        if isinstance(kind, type) and issubclass(kind, Message):
            packages |= {kind._type.partition("/")[0], *_below(kind)}
    return frozenset(packages - {"builtin_interfaces"})  # time and duration have no package
