"""Messages from the values of a YAML text (ROS wiki, YAML command line).

A dictionary names fields, a list gives all of them in order. A time may also be ``now``, a whole
number of nanoseconds or a number of seconds with a point; a header may be ``auto``: stamped now.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rosz.errors import EncodeError, near_miss
from rosz.message import Message, Sequenced
from rosz.message.schema import OCTETS, Slot, slots
from rosz.message.schema import ros1_type as slot_type
from rosz.time import DurationValue, TimeValue

__all__ = ("fill", "list_arguments", "with_arguments")

_FLOATS = frozenset({"float32", "float64"})
_STRINGS = frozenset({"string", "wstring"})
_SPELLINGS = {"secs": "sec", "nsecs": "nanosec"}


def fill(cls: type[Any], arguments: Sequence[Any], now: int) -> Any:
    """Make a message of command-line arguments that have been read as YAML.

    Args:
        cls: The message class.
        arguments: One dictionary, or a value for each field.
        now: ROS time in nanoseconds, for ``now`` and ``auto``.

    Raises:
        EncodeError: They do not fit; it names the field, and what was expected.
    """
    one_dict = len(arguments) == 1 and isinstance(arguments[0], Mapping)
    filler = _Filler(cls._type, now)
    message = filler.message(cls, arguments[0] if one_dict else list(arguments), "")
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


class _Filler:
    """Makes messages of plain values, and says where one does not fit."""

    def __init__(self, type_name: str, now: int) -> None:
        self._type = type_name
        self._now = now

    def _refusal(self, path: str, reason: str) -> EncodeError:
        return EncodeError(self._type, path.rstrip("."), reason)

    def message(self, cls: type[Any], value: Any, prefix: str) -> Any:
        """Return a message; `prefix` is its path, with a point at the end."""
        if issubclass(cls, TimeValue | DurationValue):
            return self._time(cls, value, prefix)
        if isinstance(value, cls):
            return value
        if isinstance(value, Mapping):
            return self._from_fields(cls, value, prefix)
        if isinstance(value, list | tuple):
            return self._from_list(cls, value, prefix)
        if value is None or value == "":
            return cls()
        if issubclass(cls, Sequenced) and value in {"auto", "now"}:
            header: Any = cls()
            header.stamp = self._time(type(header.stamp), "now", prefix)
            return header
        raise self._refusal(
            prefix, f"expected the fields of a {cls._type} ({_listed(cls)}), got {_shown(value)}"
        )

    def _from_fields(self, cls: type[Any], value: Mapping[Any, Any], prefix: str) -> Any:
        kinds = {slot.name: slot for slot in slots(cls)}
        made: dict[str, Any] = {}
        for key, one in value.items():
            name = self._name(cls, key, prefix)
            slot = kinds.get(name)
            made[name] = one if slot is None else self._value(slot, one, f"{prefix}{name}")
        return cls(**made)

    def _name(self, cls: type[Any], key: Any, prefix: str) -> str:
        """Return the attribute that a key means."""
        known = cls.__slots__
        for name in (key, f"{key}_", str(key).lower()):
            if name in known:
                return str(name)
        listing = f"; it has {', '.join(known)}" if known else "; it has no fields"
        raise self._refusal(prefix, f"no field '{key}'{near_miss(str(key), known) or listing}")

    def _from_list(self, cls: type[Any], values: Sequence[Any], prefix: str) -> Any:
        names = cls.__slots__
        if issubclass(cls, Sequenced) and len(values) == len(names) - 1:
            names = names[1:]  # ROS 2's form, without the sequence number
        if len(values) != len(names):
            few = "not enough" if len(values) < len(names) else "too many"
            raise self._refusal(
                prefix,
                f"{few} values: expected {len(names)} ({_listed(cls)}), got {len(values)}"
                f" ({', '.join(map(_shown, values)) or 'none'})",
            )
        return self._from_fields(cls, dict(zip(names, values, strict=True)), prefix)

    def _value(self, slot: Slot, value: Any, path: str) -> Any:
        """Return the value of a field."""
        if slot.shape == "one":
            return self._single(slot, value, path)
        if slot.kind in OCTETS and isinstance(value, str | bytes):
            value = value.encode() if isinstance(value, str) else value
        elif value is None or value == "":
            value = []
        if not isinstance(value, list | tuple | bytes):
            raise self._refusal(path, f"expected {slot_type(slot)}, got {_shown(value)}")
        if slot.shape == "fixed" and len(value) != slot.size:
            raise self._refusal(path, f"expected {slot.size} elements, got {len(value)}")
        if isinstance(value, bytes):
            return value
        return [self._single(slot, one, f"{path}[{number}]") for number, one in enumerate(value)]

    def _single(self, slot: Slot, value: Any, path: str) -> Any:
        if isinstance(slot.kind, type):
            return self.message(slot.kind, value, f"{path}.")
        if value is None and slot.kind in _STRINGS:
            return ""
        if slot.kind == "bool" and type(value) is int and value in {0, 1}:
            return bool(value)
        if slot.kind in _FLOATS and isinstance(value, str):
            try:
                return float(value)  # YAML takes 1e3 for a text
            except ValueError as error:
                raise self._refusal(
                    path, f"expected {slot_type(slot)}, got {_shown(value)}"
                ) from error
        return value

    def _time(self, cls: type[Any], value: Any, prefix: str) -> Any:
        is_time = issubclass(cls, TimeValue)
        if isinstance(value, cls):
            return value
        if value == "now" and is_time:
            return cls.from_nsec(self._now)
        try:
            made = _time_of(cls, value)
        except (TypeError, ValueError) as error:
            raise self._refusal(prefix, str(error)) from error
        if made is None:
            raise self._refusal(
                prefix,
                f"expected secs and nsecs, nanoseconds{', now' * is_time} or seconds with a point,"
                f" got {_shown(value)}",
            )
        return made


def _time_of(cls: type[Any], value: Any) -> Any:
    """Return a time or duration; ``None`` if the value has no form of one."""
    if type(value) is int:
        return cls.from_nsec(value)
    if type(value) is float:
        return cls.from_sec(value)
    if isinstance(value, Mapping):
        parts = {_SPELLINGS.get(key, key): one for key, one in value.items()}
        if parts.keys() <= {"sec", "nanosec"}:
            return cls(parts.get("sec", 0), parts.get("nanosec", 0))
    if isinstance(value, list | tuple) and len(value) == len(_SPELLINGS):
        return cls(*value)
    return cls() if value is None or value == "" else None


def _listed(cls: type[Message]) -> str:
    return ", ".join(cls.__slots__) or "no fields"


def _shown(value: Any) -> str:
    return f"{type(value).__name__} {value!r:.60}"
