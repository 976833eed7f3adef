"""Conversion of the JSON texts that clients send to messages.

msgspec decodes a text with the right fields and values into a class made for the message type,
without a step in Python for each field. All other texts are converted field by field; this accepts
more values, and its errors name the field with the wrong value.
"""

from __future__ import annotations

import base64
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Annotated, Any, TypeAlias

import msgspec

from rosz.bridges.clients import build
from rosz.bridges.rosbridge.plain import Spelling, shown_fields
from rosz.errors import UsageError
from rosz.message import INTEGER_RANGES, OCTETS, Slot, slots
from rosz.msgs.builtin_interfaces.msg import Time

_Maker: TypeAlias = Callable[[Any, int], Any]
_LARGEST = (1 << 63) - 1
"""Largest upper limit of an integer that msgspec can check."""
_FAULTS = (msgspec.MsgspecError, ValueError, TypeError, RecursionError)


def build_from_json(cls: type[Any], text: msgspec.Raw, spelling: Spelling, now: int) -> Any:
    """Return the message in a JSON text of a client; see `build`.

    Args:
        cls: Class of the message.
        text: The text.
        spelling: Spelling of field names that msgspec decodes, without a step for each field.
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
    compiler = _JsonCompiler(spelling)
    form, made = compiler.message(cls(), "m", ("header", "stamp") if cls._has_header else ())
    source = f"def make(m, now):\n    return {made}"
    exec(source, compiler.space)  # noqa: S102  # the text contains only names of fields
    return msgspec.json.Decoder(form), compiler.space["make"]


class _JsonCompiler:
    """Makes classes for the JSON of messages, and expressions that convert them to messages.

    Attributes:
        space: The names that the expressions use, with their values.
    """

    def __init__(self, spelling: Spelling) -> None:
        self._spelling = spelling
        self.space: dict[str, Any] = {"octets": _octets, "Time": Time, "UNSET": msgspec.UNSET}

    def message(self, default: Any, owner: str, timed: tuple[str, ...]) -> tuple[Any, str]:
        """Return the class and the expression for a message.

        Args:
            default: Message with the values of the fields that the JSON omits.
            owner: Expression for the instance of the class.
            timed: Path of the field that is set to the time if the JSON omits it; empty for none.
        """
        cls = type(default)
        own = {slot.name: slot for slot in slots(cls)}  # as messages have them, with other ranges
        fields: list[Any] = []
        shown, arguments = {}, []
        for name, given in shown_fields(cls, self._spelling):
            slot = own.get(given.name, given)
            before, value = getattr(default, slot.name), f"{owner}.{slot.name}"
            shown[slot.name] = name
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
        maker = f"c{len(self.space)}"
        self.space[maker] = cls
        return form, f"{maker}({', '.join(arguments)})"

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
            form, element = self.message(slot.kind(), "each", ())
            made = f"[{element} for each in {value}]"
        lengths = msgspec.Meta(min_length=least, max_length=most)
        listed: Any = Annotated[list[form], lengths]  # type: ignore[valid-type]
        return listed | str if slot.kind in OCTETS else listed, initial, made


def _scalar(kind: str) -> Any:
    if kind in INTEGER_RANGES:
        low, high = INTEGER_RANGES[kind]
        # msgspec cannot check larger limits; messages check them when they are encoded.
        return Annotated[int, msgspec.Meta(ge=low, le=high if high <= _LARGEST else None)]
    return {"bool": bool, "float32": float, "float64": float}.get(kind, str)


def _octets(value: list[int] | str, least: int, most: int | None) -> bytes:
    """Return the octets of a Base64 text or of a list of numbers."""
    octets = base64.b64decode(value, validate=True) if isinstance(value, str) else bytes(value)
    if len(octets) < least or (most is not None and len(octets) > most):
        raise ValueError(len(octets))
    return octets
