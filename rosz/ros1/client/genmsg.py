"""genmsg: names of types, and the errors of definitions, as scripts use them.

The generator API of genmsg (``MsgSpec``, ``MsgContext``, ``load_msg_by_type``, …) is missing;
``rosz.idl`` reads definitions.
"""

from __future__ import annotations

import re
from types import ModuleType

from rosz.errors import DefinitionError as InvalidMsgSpec
from rosz.errors import TypeNotFound as MsgNotFound

__all__ = (
    "EXT_MSG",
    "EXT_SRV",
    "HEADER",
    "SEP",
    "InvalidMsgSpec",
    "MsgNotFound",
    "is_legal_resource_base_name",
    "is_legal_resource_name",
    "msgs",
    "names",
    "package_resource_name",
    "resource_name",
    "resource_name_base",
    "resource_name_package",
)

msgs: ModuleType  # built by the importer, as the next one
names: ModuleType

SEP = PRN_SEPARATOR = "/"
EXT_MSG = ".msg"
EXT_SRV = ".srv"
HEADER = "Header"

_PARTS = 2
_NAME = re.compile(r"[A-Za-z][\w/]*")
_BASE = re.compile(r"[A-Za-z]\w*")


def normalize_package_context(package_context: str) -> str:
    """Strip spaces, and slashes at the end, from a package name."""
    return package_context.strip().rstrip(PRN_SEPARATOR)


def resource_name(res_pkg_name: str, name: str, my_pkg: str | None = None) -> str:
    """Return a name with its package in front, unless that is the caller's.

    Args:
        res_pkg_name: Package of the resource.
        name: Name of the resource in its package.
        my_pkg: Package of the caller.
    """
    return name if res_pkg_name == my_pkg else f"{res_pkg_name}{PRN_SEPARATOR}{name}"


def resource_name_base(name: str) -> str:
    """Return a name without its package."""
    return name.rpartition(PRN_SEPARATOR)[2]


def resource_name_package(name: str) -> str | None:
    """Return the package of a name, or None if the name has no package."""
    package, separator, _ = name.partition(PRN_SEPARATOR)
    return package if separator else None


def package_resource_name(name: str) -> tuple[str, str]:
    """Split a name into its package, which may be empty, and the rest.

    Raises:
        ValueError: The name has more than two parts.
    """
    parts = name.split(PRN_SEPARATOR)
    if len(parts) > _PARTS:
        raise ValueError(f"invalid name [{name}]")
    return (parts[0], parts[1]) if len(parts) == _PARTS else ("", name)


def is_legal_resource_name(name: str | None) -> bool:
    """Return whether a name is a letter followed by letters, digits, ``_`` and single slashes."""
    return name is not None and _NAME.fullmatch(name) is not None and "//" not in name


def is_legal_resource_base_name(name: str | None) -> bool:
    """Return whether a name is a letter followed by letters, digits and ``_``."""
    return name is not None and _BASE.fullmatch(name) is not None
