"""Messages from the values of a command line, and the names of the values that they take."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rosz.errors import EncodeError
from rosz.message.fill import fill_message_args
from rosz.message.schema import slots
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.time import DurationValue, TimeValue

__all__ = ("fill", "list_arguments", "with_arguments")


def fill(cls: type[Any], arguments: Sequence[Any], now: int) -> Any:
    """Make a message of command-line arguments that have been read as YAML.

    Args:
        cls: The message class.
        arguments: One dictionary, or a value for each field.
        now: ROS time in nanoseconds, for ``now`` and ``auto``.

    Raises:
        EncodeError: They do not fit; it names the field, and what was expected.
    """
    message = cls()
    fill_message_args(message, list(arguments), {"now": Time.from_nsec(now)})
    cls._encode(message)  # so that what does not fit is told before anything is sent
    return message


def list_arguments(cls: type[Any]) -> str:
    """Return the names of the values that a message is made of, as ``rosservice args`` prints."""
    return " ".join(_arguments(cls, ""))


def with_arguments(error: EncodeError, cls: type[Any]) -> EncodeError:
    """Return an error that also says what values a message is made of, if it does not yet."""
    if not error.field and list_arguments(cls) == " ".join(cls.__slots__):
        return error  # it is about these very names
    between = " " if error.reason.endswith("?") else "; "
    reason = f"{error.reason}{between}the values are: [{list_arguments(cls)}]"
    return EncodeError(error.type_name, error.field, reason)


def _arguments(cls: type[Any], prefix: str) -> list[str]:
    found: list[str] = []
    kinds = {slot.name: slot for slot in slots(cls)}
    for name in cls.__slots__:
        slot = kinds.get(name)
        kind = slot.kind if slot is not None and slot.shape == "one" else ""
        if isinstance(kind, type) and not issubclass(kind, TimeValue | DurationValue):
            found += _arguments(kind, f"{prefix}{name}.")
        else:
            found.append(prefix + name)
    return found
