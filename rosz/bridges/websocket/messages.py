"""Messages from what clients send: plain values, or JSON texts.

A JSON text with the right fields and values is decoded into a class of msgspec that is made for it,
without a step in Python for each field. All other texts are converted field by field, which is
lenient, and names the field where a value does not fit.
"""

from __future__ import annotations

import base64
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Annotated, Any, TypeAlias

import msgspec

from rosz.bridges.websocket.plain import Spelling
from rosz.errors import UsageError
from rosz.message import INTEGER_RANGES, OCTETS, Slot, ros1_fields, slots
from rosz.message.convert import from_plain, shown_name
from rosz.msgs.builtin_interfaces.msg import Time

__all__ = ("build", "build_from_json")

_Maker: TypeAlias = Callable[[Any, int], Any]
_LARGEST = (1 << 63) - 1
"""Largest limit that msgspec checks."""
_FAULTS = (msgspec.MsgspecError, ValueError, TypeError, RecursionError)


def build(cls: type[Any], value: Any, now: int) -> Any:
    """Return the message in plain values of a client.

    A header without a stamp gets the time (rosbridge protocol, "Publish").

    Args:
        cls: Class of the message.
        value: A dict of fields, a list of all, or None.
        now: Time in nanoseconds, also the meaning of ``now``.

    Raises:
        EncodeError: A name is not a field, or a value does not fit its field.
    """
    message = from_plain(cls, value, partial(Time.from_nsec, now), null_is_nan=True)
    if cls._has_header and isinstance(value, dict):
        header = value.get("header")
        if not isinstance(header, dict) or "stamp" not in header:
            message.header.stamp = Time.from_nsec(now)
    return message


def build_from_json(cls: type[Any], text: msgspec.Raw, spelling: Spelling, now: int) -> Any:
    """Return the message in a JSON text of a client; see `build`.

    Args:
        cls: Class of the message.
        text: The text.
        spelling: Whose names of fields are read without a conversion field by field.
        now: Time in nanoseconds.

    Raises:
        EncodeError: A name is not a field, or a value does not fit its field.
        UsageError: The text is not a JSON object.
    """
    kind: Any = cls
    decoder, make = _compiled(kind, spelling)
    try:
        return make(decoder.decode(text), now)
    except _FAULTS:
        return build(cls, _members(text), now)


def _members(text: msgspec.Raw) -> dict[str, Any]:
    try:
        return msgspec.json.decode(text, type=dict[str, Any])
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise UsageError(f"msg: {error}") from error


@lru_cache(maxsize=1024)
def _compiled(cls: Any, spelling: Spelling) -> tuple[msgspec.json.Decoder[Any], _Maker]:
    compiler = _Compiler(spelling)
    form, made = compiler.message(cls(), "m", ("header", "stamp") if cls._has_header else ())
    source = f"def make(m, now):\n    return {made}"
    exec(source, compiler.space)  # noqa: S102  # the text is made of names of fields
    return msgspec.json.Decoder(form), compiler.space["make"]


class _Compiler:
    """Makes classes for the JSON of messages, and expressions that make messages of them.

    Args:
        spelling: Whose names the fields have.

    Attributes:
        space: The names in the expressions.
    """

    def __init__(self, spelling: Spelling) -> None:
        self._ros1 = spelling == "ros1"
        self.space: dict[str, Any] = {"octets": _octets, "Time": Time, "UNSET": msgspec.UNSET}

    def message(self, default: Any, owner: str, timed: tuple[str, ...]) -> tuple[Any, str]:
        """Return the class and the expression for a message.

        Args:
            default: Message with the values of the fields that the JSON may leave out.
            owner: Expression for the instance of the class.
            timed: Path of the field that is the time if it is left out; empty for none.
        """
        cls = type(default)
        names = {new: old for old, new in cls._ros1_names.items()} if self._ros1 else {}
        fields: list[Any] = []
        shown, arguments = {}, []
        for slot in self._slots(cls):
            before, value = getattr(default, slot.name), f"{owner}.{slot.name}"
            shown[slot.name] = names.get(slot.name, shown_name(slot.name))
            if slot.shape != "one":
                form, initial, made = self._sequence(slot, before, value)
            elif isinstance(slot.kind, str):
                form, initial, made = _scalar(slot.kind), before, value
            else:
                rest = timed[1:] if timed[:1] == (slot.name,) else ()
                form, made = self.message(before, value, rest)
                initial = msgspec.field(default_factory=form)
                if timed == (slot.name,):
                    form, initial = form | msgspec.UnsetType, msgspec.UNSET
                    made = f"Time.from_nsec(now) if {value} is UNSET else {made}"
            fields.append((slot.name, form, initial))
            arguments.append(f"{slot.name}={made}")
        form = msgspec.defstruct(cls.__name__, fields, rename=shown, forbid_unknown_fields=True)
        return form, f"{self._name(cls)}({', '.join(arguments)})"

    def _slots(self, cls: Any) -> list[Slot]:
        """Return the fields that the JSON may have, with the ranges that messages have."""
        own = {slot.name: slot for slot in slots(cls)}
        shown = ros1_fields(cls) if self._ros1 else slots(cls)
        return [own.get(slot.name, slot) for slot in shown]

    def _sequence(self, slot: Slot, before: Any, value: str) -> tuple[Any, Any, str]:
        """Return the type, the default and the expression of a sequence or an array."""
        least = slot.size if slot.shape == "fixed" else 0
        most = slot.size or None
        initial: Any = msgspec.field(default_factory=partial(list, before))
        if isinstance(slot.kind, str):
            form, made = _scalar(slot.kind), value
            if slot.kind in OCTETS:
                made = f"octets({value}, {least}, {most})"
        else:
            form, one = self.message(slot.kind(), "one", ())
            made = f"[{one} for one in {value}]"
        lengths = msgspec.Meta(min_length=least, max_length=most)
        listed: Any = Annotated[list[form], lengths]  # type: ignore[valid-type]
        return listed | str if slot.kind in OCTETS else listed, initial, made

    def _name(self, cls: Any) -> str:
        name = f"c{len(self.space)}"
        self.space[name] = cls
        return name


def _scalar(kind: str) -> Any:
    if kind in INTEGER_RANGES:
        low, high = INTEGER_RANGES[kind]
        # Messages check what is too large for msgspec to check as they are encoded.
        return Annotated[int, msgspec.Meta(ge=low, le=high if high <= _LARGEST else None)]
    return {"bool": bool, "float32": float, "float64": float}.get(kind, str)


def _octets(value: list[int] | str, least: int, most: int | None) -> bytes:
    """Return octets in Base64 or as numbers.

    Raises:
        ValueError: A number is negative, it is no Base64, or there are too few or too many octets.
    """
    found = base64.b64decode(value, validate=True) if isinstance(value, str) else bytes(value)
    if len(found) < least or (most is not None and len(found) > most):
        raise ValueError(len(found))
    return found
