"""Messages with their arrays or texts left out: ``--noarr`` and ``--nostr`` of rostopic echo."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from rosz.message import Message

__all__ = ("Shortener",)


class Shortener:
    """What is to be left out.

    Args:
        no_arrays: Leave out arrays of any type.
        no_strings: Leave out texts and arrays of texts.
    """

    def __init__(self, *, no_arrays: bool = False, no_strings: bool = False) -> None:
        self._no_arrays = no_arrays
        self._no_strings = no_strings

    @property
    def idle(self) -> bool:
        """Whether nothing is left out."""
        return not (self._no_arrays or self._no_strings)

    def fields(self, message: Any) -> Iterator[str]:
        """Yield the fields of a message that are shown, for the plot form."""
        for name, kind in zip(message.__slots__, message._slot_types, strict=True):
            if not (self._no_arrays and "[" in kind) and not (
                self._no_strings and kind.startswith("string")
            ):
                yield name

    def apply(self, value: Any, kind: str) -> Any:
        """Return what to show for a value.

        Args:
            value: A message, or the value of a field.
            kind: Its type as ROS 1 spells it.
        """
        note = self._note(value, kind)
        if note is not None:
            return note
        if not isinstance(value, Message) or value._type in _STAMPS:
            return value
        stand_in = _stand_in(type(value))()
        for name, inner in zip(value.__slots__, value._slot_types, strict=True):
            setattr(stand_in, name, self.apply(getattr(value, name), inner))
        return stand_in

    def _note(self, value: Any, kind: str) -> str | None:
        """Return the text that stands for a value; ``None`` where the value stays."""
        element, bracket, _ = kind.partition("[")
        if bracket and (self._no_arrays or (self._no_strings and element.startswith("string"))):
            return f"<array type: {element}, length: {len(value)}>"
        if self._no_strings and not bracket and element.startswith("string"):
            return f"<string length: {len(value)}>"
        return None


_STAMPS = frozenset({"builtin_interfaces/Time", "builtin_interfaces/Duration"})


@lru_cache(maxsize=1024)
def _stand_in(cls: type[Message]) -> type[Any]:
    """Return a class with the fields of a message class, which hold anything."""
    return type(cls.__name__, (), {"__slots__": cls.__slots__, "_schema": (), "_type": cls._type})
