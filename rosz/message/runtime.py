"""The functions that generated codecs call: conversions, caches, and the fallback for errors.

Generated code does not check values; ``struct`` and attribute look-ups raise an exception for a
wrong value. After any such exception (``FAULTS``), the schema codec is called. It is slow, but
accepts other valid values (an int8 list for a byte sequence, big-endian bytes, …), and its errors
name the wrong value.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable
from typing import Any, TypeAlias, TypeVar

from rosz.message.layout import ROS1
from rosz.message.schema_codec import FAULTS, decode_plainly, encode_plainly
from rosz.message.sequences import (
    TRUTH,
    StringList,
    Texts,
    flags,
    numbers,
    octets,
    pack_wide,
    read_wide,
)

# The modules that users generate are checked with their settings: a name counts as exported here.
__all__ = (
    "FAULTS",
    "PADDING",
    "ROS1",
    "TRUTH",
    "Stride",
    "StringList",
    "Template",
    "decode_plainly",
    "encode_plainly",
    "flags",
    "numbers",
    "octets",
    "pack_wide",
    "read_block",
    "read_flags",
    "read_wide",
    "ros1_texts",
    "texts",
)

_T = TypeVar("_T")

PADDING = tuple(bytes(n) for n in range(8))

texts: Texts = Texts()
"""Cache of strings, shared by all types, since the same frame names occur in many types."""

ros1_texts: Texts = Texts(ROS1)

# The cache is bounded, because its keys are lengths of strings, which may differ in each message.
_MOST_SHAPES = 4096
_LONGEST_SHAPE = 1024


class _Packers(dict[Any, _T]):
    """Packers for one run of fields that contains strings; the key is the lengths of the strings.

    For known lengths, the run has a fixed layout, so that one call of ``struct`` packs it.

    Args:
        codes: Codes of ``struct`` in order, separated by blanks; ``$`` for a string's bytes,
            ``|4`` for alignment to 4 bytes.
        start: Offset of the run from the end of the header modulo 8, or -4 for the header itself.
            None if the offset varies; then it is the first part of the key.
        full: Largest alignment in the message if the offset after the run is needed: the values
            are then pairs of the packer and that offset modulo ``full``. Otherwise 0.
        most: Largest alignment of the byte layout.
    """

    __slots__ = ("_codes", "_full", "_most", "_start")

    def __init__(self, codes: str, start: int | None, full: int = 0, most: int = 8) -> None:
        super().__init__()
        self._most = most
        self._codes = codes.split()
        self._start = start
        self._full = full

    def __missing__(self, key: Any) -> _T:
        lengths = list(key) if isinstance(key, tuple) else [key]
        offset = lengths.pop(0) if self._start is None else self._start
        layout = ["<"]
        for code in self._codes:
            if code[0] == "|":
                field, alignment = "", int(code[1:])
            else:
                field = f"{lengths.pop(0)}s" if code == "$" else code
                alignment = 1 if field[-1] == "s" else min(struct.calcsize(field[-1]), self._most)
            padding = -offset % alignment
            offset += padding + struct.calcsize("<" + field)
            layout.append(f"{padding}x{field}" if padding else field)
        pack = struct.Struct("".join(layout)).pack
        entry: Any = (pack, offset % self._full) if self._full else pack
        if offset <= _LONGEST_SHAPE:
            if len(self) >= _MOST_SHAPES:
                self.clear()
            self[key] = entry
        packer: _T = entry
        return packer


Template: TypeAlias = _Packers[Callable[..., bytes]]
"""Packers without offsets: the offset after the run is known or not needed."""

Stride: TypeAlias = _Packers[tuple[Callable[..., bytes], int]]
"""Packers with the offset after the run."""


def read_flags(data: bytes) -> list[bool]:
    """Return octets as a list of bool."""
    return memoryview(data).cast("?").tolist() if data else []  # type: ignore[return-value]


def read_block(code: str, data: bytes, start: int, end: int) -> array[Any]:
    """Return an array of numbers; this copies the bytes once less than ``array(code, data)``.

    Raises:
        ValueError: The number of bytes is not a multiple of the size of a number.
    """
    block = array(code)
    block.frombytes(memoryview(data)[start:end])
    return block
