"""roslib.msgs, roslib.srvs and genmsg.msgs: names of field types, and files of definitions."""

from __future__ import annotations

import re

from rosz.ros1.client.genmsg import (
    EXT_MSG,
    EXT_SRV,
    HEADER,
    SEP,
    is_legal_resource_base_name,
    is_legal_resource_name,
)
from rosz.ros1.tools.roslib.packages import list_package_resources, resource_file

EXT = EXT_MSG
IODELIM = "---"
CONSTCHAR = "="
COMMENTCHAR = "#"
TIME = "time"
DURATION = "duration"
_WHOLE = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")
PRIMITIVE_TYPES = [*_WHOLE, "float32", "float64", "string", "bool", "char", "byte"]
BUILTIN_TYPES = [*PRIMITIVE_TYPES, TIME, DURATION]
RESERVED_TYPES = [*BUILTIN_TYPES, HEADER]

_ARRAY = re.compile(r"(\[\d*\])*")


class MsgSpecException(ValueError):
    """A type of a field is not well-formed."""


def base_msg_type(type_: str | None) -> str | None:
    """Return a type without its array part."""
    return None if type_ is None else type_.partition("[")[0]


def resolve_type(type_: str, package_context: str) -> str:
    """Return a type with its package.

    Args:
        type_: Type, such as ``String[]``.
        package_context: Package of the definition that it stands in.
    """
    base = base_msg_type(type_)
    if base == HEADER:
        return f"std_msgs{SEP}{HEADER}"
    return type_ if base in BUILTIN_TYPES or SEP in type_ else f"{package_context}{SEP}{type_}"


def parse_type(type_: str) -> tuple[str, bool, int | None]:
    """Return the base of a type, whether it is an array, and the array's length if that is fixed.

    Raises:
        MsgSpecException: The type is empty, or its array part is not well-formed.
    """
    if not type_:
        raise MsgSpecException("Invalid empty type")
    base, *lengths = type_.split("[")
    if not lengths:
        return type_, False, None
    if len(lengths) > 1:
        raise MsgSpecException(f"Currently only support 1-dimensional array types: {type_}")
    if lengths == ["]"]:
        return base, True, None
    try:
        return base, True, int(lengths[0][:-1])
    except ValueError:
        raise MsgSpecException(f"Invalid array dimension: [{lengths[0][:-1]}]") from None


def is_valid_msg_type(x: str) -> bool:
    """Return whether a type is well-formed."""
    if not x or x != x.strip():
        return False
    base = x.partition("[")[0]
    return is_legal_resource_name(base) and _ARRAY.fullmatch(x[len(base) :]) is not None


def is_valid_constant_type(x: str) -> bool:
    """Return whether a constant may have a type."""
    return x in PRIMITIVE_TYPES


def is_valid_msg_field_name(x: str) -> bool:
    """Return whether a field may have a name."""
    return is_legal_resource_base_name(x)


def is_builtin(msg_type_name: str) -> bool:
    """Return whether a type is one of the language, not that of a package."""
    return msg_type_name in BUILTIN_TYPES


def is_header_type(type_: str) -> bool:
    """Return whether a type is the header of a message, in any of its spellings."""
    return type_ in {HEADER, f"std_msgs/{HEADER}", f"roslib/{HEADER}"}


def list_msg_types(package: str, include_depends: bool) -> list[str]:
    """Return the names of the messages of a package, without it.

    Args:
        package: Name of the package.
        include_depends: Whether to add those of the packages that it depends on, with them.

    Raises:
        ResourceNotFound: The package does not exist.
    """
    return _list_types(package, include_depends, EXT_MSG)


def list_srv_types(package: str, include_depends: bool) -> list[str]:
    """Return the names of the services of a package; see `list_msg_types`."""
    return _list_types(package, include_depends, EXT_SRV)


def _list_types(package: str, include_depends: bool, suffix: str) -> list[str]:
    files = list_package_resources(
        package, include_depends, suffix[1:], lambda path: path.endswith(suffix)
    )
    return [name.removesuffix(suffix) for name in files]


def msg_file(package: str, type_: str) -> str:
    """Return the path of the definition of a message; it need not exist.

    Raises:
        InvalidROSPkgException: The package does not exist.
    """
    return resource_file(package, "msg", type_ + EXT_MSG)


def srv_file(package: str, type_: str) -> str:
    """Return the path of the definition of a service; see `msg_file`."""
    return resource_file(package, "srv", type_ + EXT_SRV)
