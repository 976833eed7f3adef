"""The codecs of ROS 1's byte layout, compiled from the schema of a class at first use.

Generated code does not check its values. Where it fails, the slow codec accepts unusual values that
are valid, or names the wrong one.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import starmap
from struct import Struct
from typing import Any

from rosz.message import runtime
from rosz.message.decoder_source import DecoderSource
from rosz.message.encoder_source import EncoderSource
from rosz.message.layout import ROS1
from rosz.message.schema import Slot
from rosz.message.schema_codec import decode_plainly, encode_plainly
from rosz.message.source_names import SourceNames


def compile_encoder(cls: type[Any]) -> Callable[[Any], bytes]:
    """Return the function that encodes messages of a class in ROS 1's layout.

    It raises EncodeError where a value does not fit its field, or where ROS 1 has no such type.
    """
    if _has_wide_text(cls):
        return lambda m: encode_plainly(m, cls, ROS1)
    names = _Names()
    encode: Callable[[Any], bytes] = names.function(
        "m", EncoderSource(cls, names).lines(), "_plain", cls
    )
    return encode


def compile_decoder(cls: type[Any]) -> Callable[[bytes], Any]:
    """Return the function that decodes messages of a class from ROS 1's layout.

    It raises DecodeError for bytes that are not such a message. Bytes behind it are ignored, as
    genpy ignores them.
    """
    if _has_wide_text(cls):
        return lambda data: decode_plainly(data, cls, ROS1)
    names = _Names()
    lines = DecoderSource(cls, names).lines()
    decode: Callable[[bytes], Any] = names.function("data", lines, "_explain", cls)
    return decode


class _Names(SourceNames):
    """Names of a module that is never written down; its types are message classes."""

    def __init__(self) -> None:
        super().__init__(ROS1)
        self._classes: dict[Any, str] = {}

    def fields(self, kind: Any) -> tuple[Slot, ...]:
        return _unbounded_fields(kind)

    def cls(self, kind: Any) -> str:
        return self._classes.setdefault(kind, f"_C{len(self._classes)}")

    def make(self, kind: Any, values: Sequence[str]) -> str:
        slots = ROS1.fields(kind)
        if tuple(slot.name for slot in slots) != kind.__struct_fields__[: len(slots)]:
            values = [f"{slot.name}={value}" for slot, value in zip(slots, values, strict=True)]
        return f"{self.cls(kind)}({', '.join(values)})"

    def function(self, argument: str, lines: list[str], fallback: str, cls: type[Any]) -> Any:
        """Return a function of `lines`; `fallback` names that of the slow codec."""
        source = [*self.fresh(), f"def code({argument}):", "    try:"]
        source += [f"        {line}" for line in lines]
        call = f"{fallback}({argument}, {self.cls(cls)}, {self.use('ROS1')})"
        source += ["    except _FAULTS:", f"        return {call}"]
        space: dict[str, Any] = {
            "_FAULTS": runtime.FAULTS,
            "_Struct": Struct,
            "_array": array,
            "_explain": decode_plainly,
            "_plain": encode_plainly,
            "_starmap": starmap,
            **{name: kind for kind, name in self._classes.items()},
            **{f"_{name}": getattr(runtime, name) for name in self.runtime},
        }
        exec("\n".join(source), space)  # noqa: S102  # the text is made of numbers and attributes
        return space["code"]


@lru_cache(maxsize=256)
def _unbounded_fields(cls: Any) -> tuple[Slot, ...]:
    """Return the fields of a class without bounds, which ROS 1 does not have."""
    return tuple(
        Slot(slot.name, slot.kind, 0, "sequence" if slot.counted else slot.shape, slot.size)
        for slot in ROS1.fields(cls)
    )


def _has_wide_text(cls: type[Any]) -> bool:
    """Return whether a message has strings that ROS 1 does not have."""
    return any(
        slot.kind == "wstring" if isinstance(slot.kind, str) else _has_wide_text(slot.kind)
        for slot in ROS1.fields(cls)
    )
