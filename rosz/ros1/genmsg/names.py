"""genmsg.names: names of resources in packages, ``std_msgs/String``."""

from __future__ import annotations

import re

__all__ = (
    "PRN_SEPARATOR",
    "is_legal_resource_base_name",
    "is_legal_resource_name",
    "normalize_package_context",
    "package_resource_name",
    "resource_name",
    "resource_name_base",
    "resource_name_package",
)

PRN_SEPARATOR = "/"
_PARTS = 2
_NAME = re.compile(r"[A-Za-z][\w/]*")
_BASE = re.compile(r"[A-Za-z]\w*")


def normalize_package_context(package_context: str) -> str:
    """Take spaces, and slashes at the end, off the name of a package."""
    return package_context.strip().rstrip(PRN_SEPARATOR)


def resource_name(res_pkg_name: str, name: str, my_pkg: str | None = None) -> str:
    """Put a package in front of a name, unless it is the package that asks.

    Args:
        res_pkg_name: Package of the resource.
        name: Its name in there.
        my_pkg: Package that asks.
    """
    return name if res_pkg_name == my_pkg else f"{res_pkg_name}{PRN_SEPARATOR}{name}"


def resource_name_base(name: str) -> str:
    """Return a name without its package."""
    return name.rpartition(PRN_SEPARATOR)[2]


def resource_name_package(name: str) -> str | None:
    """Return the package of a name; None where it has none."""
    package, separator, _ = name.partition(PRN_SEPARATOR)
    return package if separator else None


def package_resource_name(name: str) -> tuple[str, str]:
    """Part a name into package, which may be empty, and name.

    Raises:
        ValueError: It has more than two parts.
    """
    parts = name.split(PRN_SEPARATOR)
    if len(parts) > _PARTS:
        raise ValueError(f"invalid name [{name}]")
    return (parts[0], parts[1]) if len(parts) == _PARTS else ("", name)


def is_legal_resource_name(name: str | None) -> bool:
    """Tell whether it is a letter, followed by letters, digits, ``_`` and single slashes."""
    return name is not None and _NAME.fullmatch(name) is not None and "//" not in name


def is_legal_resource_base_name(name: str | None) -> bool:
    """Tell whether it is a letter, followed by letters, digits and ``_``."""
    return name is not None and _BASE.fullmatch(name) is not None
