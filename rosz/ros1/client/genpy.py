"""genpy: messages, times and durations as generated ROS 1 code uses them (ROS wiki, genpy)."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from types import ModuleType
from typing import Any

from rosz.errors import DecodeError as DeserializationError
from rosz.errors import DefinitionError, TypeNotFound
from rosz.errors import EncodeError as SerializationError
from rosz.errors import MessageError as MessageException
from rosz.idl import full_name, split_definitions
from rosz.message import Message
from rosz.msgs.builtin_interfaces.msg import Duration as DurationMessage
from rosz.msgs.builtin_interfaces.msg import Time as TimeMessage
from rosz.names import short_type
from rosz.ros1.importer import type_store
from rosz.time import ClassicConstructor, DurationValue, StampValue, TimeValue

__all__ = (
    "DeserializationError",
    "Duration",
    "Message",
    "MessageException",
    "SerializationError",
    "TVal",
    "Time",
    "dynamic",
    "message",
    "rostime",
)

dynamic: ModuleType  # built by the importer, as the next two
message: ModuleType
rostime: ModuleType

_SIGNED = {"byte": 8, "int8": 8, "int16": 16, "int32": 32, "int64": 64}
_UNSIGNED = {"char": 8, "uint8": 8, "uint16": 16, "uint32": 32, "uint64": 64}
_FLOATS = frozenset({"float32", "float64"})
_HEADERS = frozenset({"Header", "std_msgs/Header", "roslib/Header"})


class _Stamps(ClassicConstructor):
    """Metaclass of classes whose instances are all times, or durations, of messages too."""

    def __instancecheck__(self, instance: object) -> bool:
        return isinstance(instance, self.__mro__[1])


class TVal(StampValue, Message, metaclass=_Stamps):
    """Seconds and nanoseconds: the base of times and durations."""

    sec: int = 0
    nanosec: int = 0

    def _comparable(self, other: object) -> int | None:
        return other.to_nsec() if type(other) is type(self) else None

    def __repr__(self) -> str:
        return f"genpy.TVal[{self.to_nsec()}]"


class Time(TimeMessage, metaclass=_Stamps):
    """A point in time: ``Time(1.5)``, ``Time(1, 500000000)``."""

    def __repr__(self) -> str:
        return f"genpy.Time[{self.to_nsec()}]"


class Duration(DurationMessage, metaclass=_Stamps):
    """A duration: ``Duration(1.5)``, ``Duration(1, 500000000)``."""

    def __repr__(self) -> str:
        return f"genpy.Duration[{self.to_nsec()}]"


def generate_dynamic(core_type: str, msg_cat: str) -> dict[str, type[Message]]:
    """Return the classes of the message types in a text, by name.

    Args:
        core_type: Name of the first type, such as ``std_msgs/String``.
        msg_cat: Its definition. Those of the types in it follow, each behind a line of ``=`` and a
            line ``MSG: package/Name``, as in a connection header.

    Raises:
        DefinitionError: A definition is not well-formed, or a type in it does not exist.
    """
    texts = split_definitions(full_name(core_type, "msg"), msg_cat)
    find = type_store().message_from_text
    return {short_type(name): find(name, text, texts) for name, text in texts.items()}


class _FieldError(SerializationError):
    """A value does not fit the type of its field; the text is that of genpy."""

    def __init__(self, field: str, reason: str) -> None:
        super().__init__("", field, reason)

    def __str__(self) -> str:
        return f"field {self.field} {self.reason}"


def is_simple(type_: str) -> bool:
    """Return whether a type is a number or a bool."""
    return type_ in _SIGNED or type_ in _UNSIGNED or type_ in _FLOATS or type_ == "bool"


def get_message_class(message_type: str, reload_on_error: bool = False) -> type[Any] | None:  # noqa: ARG001  # genpy's
    """Return the message class of a name.

    Args:
        message_type: Type name, such as ``std_msgs/String``.
        reload_on_error: Ignored; definitions are read when they are needed.

    Returns:
        The class, or None if there is no such type.

    Raises:
        ValueError: The name has no package.
    """
    return _find(message_type, type_store().message)


def get_service_class(service_type: str, reload_on_error: bool = False) -> type[Any] | None:  # noqa: ARG001  # genpy's
    """Return the service class of a name; see `get_message_class`."""
    return _find(service_type, type_store().service)


def _find(name: str, look: Any) -> type[Any] | None:
    if "/" not in name:
        if name != "Header":
            raise ValueError(f"message type is missing package name: {name}")
        name = "std_msgs/Header"
    try:
        type_class: type[Any] = look(name)
    except (DefinitionError, TypeNotFound):
        return None
    return type_class


def get_printable_message_args(msg: Any, buff: Any = None, prefix: str = "") -> str:
    """Return the names of the values in a message, separated by spaces.

    Args:
        msg: The message.
        buff: A ``StringIO`` to append the names to; its content is returned then.
        prefix: Prefix of each name.
    """
    text = " ".join(_leaves(msg, prefix))
    if buff is None:
        return text
    buff.write(f"{text} " if text else "")
    written: str = buff.getvalue().rstrip()
    return written


def _leaves(msg: Any, prefix: str) -> list[str]:
    names: list[str] = []
    for name in msg.__slots__:
        value = getattr(msg, name)
        if isinstance(value, Message) and not isinstance(value, StampValue):
            names += _leaves(value, f"{prefix}{name}.")
        else:
            names.append(prefix + name)
    return names


def check_type(field_name: str, field_type: str, field_val: Any) -> None:
    """Check a value against the type of a field.

    Args:
        field_name: Name of the field in the error.
        field_type: Type as ROS 1 writes it: ``uint8``, ``string[]``, ``geometry_msgs/Point``, …
        field_val: The value.

    Raises:
        SerializationError: The value does not fit.
    """
    if field_type.endswith("]"):
        _check_array(field_name, field_type.partition("[")[0], field_val)
    elif field_type in _SIGNED or field_type in _UNSIGNED:
        _check_integer(field_name, field_type, field_val)
    elif field_type in _SINGLE:
        fits, reason = _SINGLE[field_type]
        if not fits(field_val):
            raise _FieldError(field_name, reason)
    else:
        _check_message(field_name, field_type, field_val)


def _is_float(value: Any) -> bool:
    return type(value) in (int, float) or (
        hasattr(value, "dtype") and getattr(value, "shape", None) == ()
    )


_SINGLE: dict[str, tuple[Callable[[Any], bool], str]] = {
    "float32": (_is_float, "must be float type"),
    "float64": (_is_float, "must be float type"),
    "bool": (lambda value: value in (True, False, 0, 1), "is not a bool"),
    "string": (
        lambda value: isinstance(value, str | bytes),
        "must be of type bytes or an ascii string",
    ),
    "time": (lambda value: isinstance(value, TimeValue), "must be of type Time"),
    "duration": (lambda value: isinstance(value, DurationValue), "must be of type Duration"),
}


def _check_integer(name: str, kind: str, value: Any) -> None:
    signed = kind in _SIGNED
    if type(value) is not int or (not signed and value < 0):
        raise _FieldError(name, f"must be {'an integer' if signed else 'unsigned integer'} type")
    limit = 1 << (_SIGNED[kind] - 1 if signed else _UNSIGNED[kind])
    if value >= limit or value < -limit:
        raise _FieldError(name, f"exceeds specified width [{kind}]")


def _check_array(name: str, base: str, values: Any) -> None:
    if isinstance(values, bytes | str):
        if base not in {"char", "uint8", "byte"}:
            raise _FieldError(name, "must be a list or tuple type. Only uint8[] can be a string")
        return
    if not isinstance(values, list | tuple | array) and not hasattr(values, "tolist"):
        raise _FieldError(name, "must be a list or tuple type")
    for value in values.tolist() if hasattr(values, "tolist") else values:
        check_type(f"{name}[]", base, value)


def _check_message(name: str, kind: str, value: Any) -> None:
    if not isinstance(value, Message):
        raise _FieldError(name, f"must be of type [{kind}]")
    if value._type in _HEADERS:
        if kind not in _HEADERS:
            raise _FieldError(name, f"must be a Header instead of a {value._type}")
    elif value._type != kind:
        raise _FieldError(name, f"must be of type {kind} instead of {value._type}")
    for slot, inner in zip(value.__slots__, value._slot_types, strict=True):
        check_type(f"{name}.{slot}", inner, getattr(value, slot))
