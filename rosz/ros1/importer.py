"""Makes ROS 1's Python modules and message packages importable.

It adds two finders to ``sys.meta_path``. The first one stands in front and finds what rosz ships
(``std_msgs``, ``rospy``, …), and ``<package>.msg``, ``<package>.srv`` and ``<package>.cfg`` of any
package on the package path. The second one stands at the end and finds packages that nothing else
provides; only it searches the package path for a plain name. It finds the Python modules that
packages offer (`python_setup`), with their messages in them as in catkin's devel space.

A module of rosz is the same object as rosz's own: ``std_msgs.msg`` is ``rosz.msgs.std_msgs.msg``.
"""

from __future__ import annotations

import copy  # noqa: F401  # tries to import Jython's "org", which must not be searched for
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cached_property
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import find_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from rosz.environment import Environment, package_index
from rosz.errors import PackageError, RoszError
from rosz.message import Ros2Default
from rosz.packages import PackageIndex
from rosz.replacements import instead_of
from rosz.ros1 import derived
from rosz.ros1.modules import (
    ELSEWHERE,
    EXTRAS,
    LAST,
    MODULES,
    SUBMODULES,
    add_submodules,
    attribute,
    explain_missing,
    submodule,
)
from rosz.ros1.star_import import add_names
from rosz.typestore import Kind, TypeStore, is_generated, shipped_packages, shipped_types

if TYPE_CHECKING:
    from rosz.ros1.python_setup import Offers

__all__ = ("install", "package_path", "type_store", "uninstall")

_KINDS: dict[str, Kind] = {"msg": "msg", "srv": "srv", "action": "action"}
_CFG = "cfg"
_RCLPY = "rclpy"


def install(store: TypeStore | None = None, packages: PackageIndex | None = None) -> None:
    """Make ROS 1's names importable in this process; again does nothing.

    Args:
        store: Store of message classes; by the environment of the process when not given.
        packages: Packages to search; by the environment of the process when not given.
    """
    if any(isinstance(finder, _FrontFinder) for finder in sys.meta_path):
        return
    derived.install()
    types = _Types(store, packages)
    sys.meta_path.insert(0, _FrontFinder(types))
    sys.meta_path.append(_EndFinder(types))


def uninstall() -> None:
    """Remove the finders; modules that are imported stay."""
    sys.meta_path[:] = [
        one for one in sys.meta_path if not isinstance(one, _FrontFinder | _EndFinder)
    ]


def type_store() -> TypeStore:
    """Return the store of the message classes that imports return."""
    install()
    return next(one.types.store for one in sys.meta_path if isinstance(one, _FrontFinder))


def package_path() -> PackageIndex:
    """Return the packages that imports search."""
    install()
    return next(one.types.packages for one in sys.meta_path if isinstance(one, _FrontFinder))


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
        """The Python modules of packages."""
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
        """Return the dynamic_reconfigure files of a package."""
        from rosz.ros1.dynamic_reconfigure import find_files

        try:
            return find_files(self.packages.find(package).path)
        except RoszError:  # a broken package must not break other imports
            return []

    def folder(self, package: str) -> Path | None:
        """Return the folder of a package that has types or dynamic_reconfigure files."""
        try:
            known = any(self.store.has(package, kind) for kind in _KINDS.values())
            return self.packages.find(package).path if known or self.cfg_files(package) else None
        except RoszError:  # a broken package must not break other imports
            return None


class _AliasLoader(Loader):
    """Loads a module that exists under another name."""

    def __init__(self, load: Callable[[], ModuleType]) -> None:
        self._load = load
        self._name = ""
        self._spec: ModuleSpec | None = None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module."""
        module = self._load()
        self._name, self._spec = spec.name, module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Add submodules; the module has been executed under its own name."""
        module.__spec__ = self._spec or module.__spec__
        add_submodules(self._name)


def _alias(name: str, load: Callable[[], ModuleType]) -> ModuleSpec:
    return ModuleSpec(name, _AliasLoader(load), is_package=True)


def _loaded(name: str, load: Callable[[], ModuleType]) -> ModuleType:
    """Load a module of rosz.

    Raises:
        ModuleNotFoundError: It needs an extra, which the text names.
    """
    try:
        module = load()
    except ModuleNotFoundError as error:
        extra = EXTRAS.get(name.partition(".")[0], {}).get(error.name or "")
        if extra is None:
            raise
        text = f"{error}; {name} needs it, run: pip install 'rosz[{extra}]'"
        raise ModuleNotFoundError(text, name=error.name) from error
    explain_missing(name, module)
    return module


class _FrontFinder(MetaPathFinder):
    def __init__(self, types: _Types) -> None:
        self.types = types
        self._shipped = shipped_packages()
        self._modules = frozenset((*MODULES, *ELSEWHERE))

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
            return self._of_rosz(alias, alias) if alias in ELSEWHERE else self._compiled(fullname)
        found = self._of_ros(fullname, root, rest, path)
        if found is not None:
            Ros2Default.ros1 = root != _RCLPY and _RCLPY not in sys.modules
        return found

    def _of_ros(
        self, fullname: str, root: str, rest: str, path: Sequence[str] | None
    ) -> ModuleSpec | None:
        """Find a module by its name in ROS."""
        first, _, inner = rest.partition(".")
        kind = _KINDS.get(first) if fullname not in SUBMODULES else None
        if kind == "action" and not self.types.store.has(root, kind):
            kind = None  # such as rclpy.action
        if kind is not None:
            return self._of_package(fullname, root, kind, inner, path)
        if first == _CFG:
            return self._of_cfg(fullname, root, inner, path)
        if root in self._modules or fullname in self._modules:
            return self._of_rosz(fullname, root)
        if root in self._shipped and not rest:
            return _alias(fullname, lambda: self._of_messages(root))
        return None

    def _of_messages(self, package: str) -> ModuleType:
        """Return the module of a shipped package; its modules of types load when they are used.

        In ROS 1 ``import std_msgs`` is enough for ``std_msgs.msg``, which rospy has imported.
        """
        module = import_module(f"rosz.msgs.{package}")
        homes = {
            kind: f"{package}.{kind}" for kind in _KINDS if shipped_types(package, _KINDS[kind])
        }
        vars(module).setdefault("__getattr__", attribute(package, module, homes))
        return module

    def _of_rosz(self, name: str, root: str) -> ModuleSpec | None:
        """Find ``rospy`` or one of its submodules; importing it may need an extra."""
        if name in SUBMODULES:
            return _alias(name, lambda: _loaded(name, lambda: submodule(name)))
        below = ELSEWHERE.get(root, f"ros1.{root}") + name.removeprefix(root)
        own = f"rosz.{ELSEWHERE.get(name, below)}"
        try:
            known = own in sys.modules or find_spec(own) is not None
        except ModuleNotFoundError:  # a plain module has no submodules
            known = False
        return _alias(name, lambda: _loaded(name, lambda: import_module(own))) if known else None

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
        """Find ``<package>.msg``, or ``<package>.msg._Type`` as genpy has it."""
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
        if not inner.startswith("_") or not hasattr(module, inner[1:]):
            return None
        return _alias(name, lambda: _single(name, module, inner[1:]))

    def _module(self, package: str, kind: Kind) -> ModuleType:
        shipped = package in self._shipped
        types = self.types
        module = types.shipped(package, kind) if shipped else types.store.module(package, kind)
        return module if kind == "action" else add_names(module)

    def _of_cfg(
        self, name: str, package: str, inner: str, path: Sequence[str] | None
    ) -> ModuleSpec | None:
        """Find ``<package>.cfg``, or ``<package>.cfg.<Name>Config`` as catkin generates it."""
        files = self.types.cfg_files(package)
        if not files:
            return None
        if inner:
            from rosz.ros1.dynamic_reconfigure.cfgfile import load

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
            ModuleNotFoundError: ROS has such a module and rosz has not; the text says what to use.
        """
        root, _, rest = fullname.partition(".")
        # Python's library tries modules of other systems while modules that are needed here load.
        if root in sys.stdlib_module_names:
            return None
        found = None
        if path is None and not rest:
            found = self._of_package(fullname)
        elif root in self._shipped and "." not in rest:
            code = self._types.offers.find(root)
            found = PathFinder.find_spec(fullname, [str(code)]) if code is not None else None
        if found is not None:
            return found
        if fullname in LAST:
            return _alias(fullname, lambda: import_module(f"rosz.ros1.{fullname}"))
        instead = instead_of(fullname)
        if instead:
            text = f"No module named '{fullname}': rosz does not have it: {instead}"
            raise ModuleNotFoundError(text, name=fullname)
        return None

    def _of_package(self, name: str) -> ModuleSpec | None:
        """Find what a package offers: its Python code, its types, or both."""
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
        """Run the module."""
        file = Path(self.path)
        folder = str((file.parent if file.name == "__init__.py" else file).parent)
        if folder not in sys.path:
            sys.path.insert(0, folder)
        super().exec_module(module)


def _single(name: str, module: ModuleType, type_name: str) -> ModuleType:
    """Return a module with one type, and with the messages of a service."""
    single = ModuleType(name)
    for each in (type_name, f"{type_name}Request", f"{type_name}Response"):
        if hasattr(module, each):
            setattr(single, each, getattr(module, each))
    return single
