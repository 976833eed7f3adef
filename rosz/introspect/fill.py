"""Messages from the values of a YAML text (ROS wiki, YAML command line).

A dictionary names fields, a list gives all of them in order. A time may also be ``now`` or a number
of nanoseconds; a header may be ``auto``: stamped now.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rosz.errors import EncodeError
from rosz.message.fill import fill_message_args
from rosz.message.schema import slots
from rosz.time import DurationValue, TimeValue

__all__ = ("fill", "list_arguments", "with_arguments")

_SECOND = 1_000_000_000


def fill(cls: type[Any], arguments: Sequence[Any], now: int) -> Any:
    """Make a message of command-line arguments that have been read as YAML.

    Args:
        cls: The message class.
        arguments: One dictionary, or a value for each field.
        now: ROS time in nanoseconds, for ``now`` and ``auto``.

    Raises:
        EncodeError: They do not fit; it names the field, and what was expected.
    """
    from rosz.msgs.builtin_interfaces.msg import Time

    message = cls()
    fill_message_args(message, list(arguments), {"now": Time(*divmod(now, _SECOND))})
    cls._encode(message)  # so that a value which does not fit is told before anything is sent
    return message


def list_arguments(cls: type[Any]) -> str:
    """Return the names of the values that a message is made of, as ``rosservice args`` prints."""
    return " ".join(_arguments(cls, ""))


def with_arguments(error: EncodeError, cls: type[Any]) -> EncodeError:
    """Return an error that also says what values a message is made of."""
    between = " " if error.reason.endswith("?") else "; "
    reason = f"{error.reason}{between}the values are: [{list_arguments(cls)}]"
    return EncodeError(error.type_name, error.field, reason)


def _arguments(cls: type[Any], prefix: str) -> list[str]:
    found: list[str] = []
    kinds = {slot.name: slot for slot in slots(cls)}
    for name in cls.__slots__:
        slot = kinds.get(name)
        if slot is not None and slot.shape == "one" and _is_message(slot.kind):
            found += _arguments(slot.kind, f"{prefix}{name}.")  # type: ignore[arg-type]  # a class
        else:
            found.append(prefix + name)
    return found


def _is_message(kind: Any) -> bool:
    return isinstance(kind, type) and not issubclass(kind, TimeValue | DurationValue)
