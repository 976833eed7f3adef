"""Names of field types as definitions spell them, for ``roslib.msgs`` and ``genmsg.msgs``."""

from __future__ import annotations

import re

from rosz.ros1.genmsg import HEADER, SEP, is_legal_resource_base_name, is_legal_resource_name

__all__ = (
    "BUILTIN_TYPES",
    "COMMENTCHAR",
    "CONSTCHAR",
    "DURATION",
    "EXT",
    "PRIMITIVE_TYPES",
    "RESERVED_TYPES",
    "TIME",
    "MsgSpecException",
    "base_msg_type",
    "is_builtin",
    "is_header_type",
    "is_valid_constant_type",
    "is_valid_msg_field_name",
    "is_valid_msg_type",
    "parse_type",
    "resolve_type",
)

EXT = ".msg"
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
