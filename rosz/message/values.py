"""Messages from and to plain values: dicts, JSON, YAML, and what ``rostopic pub`` takes."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Callable
from typing import Any, TypeAlias, TypeVar

import yaml

from rosz.errors import EncodeError
from rosz.message.base import Message
from rosz.message.fill import fill_message_args, shown_name
from rosz.message.schema import slots
from rosz.message.text import strify_message
from rosz.time import TimeValue

__all__ = (
    "Now",
    "from_json",
    "from_plain",
    "from_yaml",
    "to_json",
    "to_jsonable",
    "to_plain",
    "to_yaml",
)

_M = TypeVar("_M", bound=Message)

_NO_YAML = (yaml.YAMLError, ValueError, AttributeError, RecursionError)
"""What PyYAML raises: its own errors, and those of what it makes values with, such as dates."""

Now: TypeAlias = "TimeValue | Callable[[], TimeValue]"
"""What ``now`` means: a time, or what gives the time of the moment."""


def to_plain(message: Message) -> dict[str, Any]:
    """Return a message as dicts, lists, numbers, texts and bytes, by the names of its fields."""
    return {
        shown_name(slot.name): _plain(getattr(message, slot.name)) for slot in slots(type(message))
    }


def to_json(message: Message) -> str:
    """Return a message as JSON.

    Sequences of octets are Base64 texts; numbers that JSON lacks are ``"NaN"``, ``"Infinity"`` and
    ``"-Infinity"``. :func:`from_json` reads all of them.
    """
    return json.dumps(to_jsonable(to_plain(message)), ensure_ascii=False, allow_nan=False)


def to_jsonable(value: Any) -> Any:
    """Return a message, or any value of a field, as values that JSON has; see `to_json`."""
    if hasattr(value, "_schema"):
        value = {shown_name(name): getattr(value, name) for name in type(value).__slots__}
    if isinstance(value, dict):
        return {name: to_jsonable(one) for name, one in value.items()}
    if isinstance(value, bytes | bytearray):
        return base64.b64encode(value).decode()
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [to_jsonable(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    return value


def to_yaml(message: Message) -> str:
    """Return a message as YAML, in the form that ``rostopic echo`` shows."""
    return strify_message(message)


def from_plain(cls: type[_M], value: Any, now: Now | None = None) -> _M:
    """Build a message from plain values.

    Args:
        cls: Class of the message.
        value: A dict with some of the fields, a list with all of them in order, or None for a
            message of defaults.
        now: What ``now`` and ``auto`` mean; they mean nothing when not given.

    Raises:
        EncodeError: A name is no field of its message, or a value does not fit its field.
    """
    message = cls()
    if value is not None:
        fill_message_args(message, value, {} if now is None else {"now": now})
    return message


def from_json(cls: type[_M], text: str | bytes) -> _M:
    """Build a message from JSON.

    Raises:
        EncodeError: The text is no JSON, or does not fit the class.
    """
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise EncodeError(cls._type, "", f"no JSON: {error}") from error
    return from_plain(cls, value)


def from_yaml(cls: type[_M], text: str, now: Now | None = None) -> _M:
    """Build a message from YAML: a dict, a list of all fields, or the value of the only field.

    Raises:
        EncodeError: The text is no YAML, or does not fit the class.
    """
    try:
        value = yaml.safe_load(text)
    except _NO_YAML as error:
        reason = " ".join(str(error).split())
        raise EncodeError(cls._type, "", f"no YAML: {reason}") from error
    if value is not None and not isinstance(value, dict | list):
        value = [value]
    return from_plain(cls, value, now)


def _plain(value: Any) -> Any:
    if isinstance(value, Message):
        return to_plain(value)
    if isinstance(value, bytes | bytearray | memoryview):
        return bytes(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return value
