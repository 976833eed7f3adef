"""Names that ``from <package>.msg import *`` binds beside the types, as with genpy.

Each module that genpy generates imports ``genpy``, ``struct``, ``sys``, ``codecs`` and the packages
of the types in a definition, and has no ``__all__``. Programs have come to use these names without
an import of their own: ``sys.argv``, ``geometry_msgs.msg.Point()``.
"""

from __future__ import annotations

import codecs
import struct
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Any

from rosz.message import Message, Service

__all__ = ("add_names",)

_PLAIN = {"codecs": codecs, "python3": True, "struct": struct, "sys": sys}


class _Genpy(ModuleType):
    """genpy, imported at its first use, since it takes longer than the messages."""

    def __getattr__(self, name: str) -> Any:
        return getattr(import_module("genpy"), name)


def add_names(module: ModuleType) -> ModuleType:
    """Add the names to a module of messages or services, and return it; again does nothing.

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
    found: set[str] = set()
    for _, kind, _ in cls._schema:
        if isinstance(kind, type) and issubclass(kind, Message):
            found |= {kind._type.partition("/")[0], *_below(kind)}
    return frozenset(found - {"builtin_interfaces"})  # time and duration have no package
