"""The functions that generated codecs call: conversions, caches, and the fallback for errors.

Generated code does not check its values; ``struct`` and attribute look-ups raise where they are
wrong. Any such exception (``FAULTS``) leads to the schema codec, which is slow, accepts what is
valid (an int8 list for a byte sequence, big-endian bytes, …) and otherwise says what is wrong.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable
from typing import Any, TypeAlias, TypeVar

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

__all__ = (
    "FAULTS",
    "PADDING",
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
    "texts",
)

_T = TypeVar("_T")

PADDING = tuple(bytes(n) for n in range(8))

texts: Texts = Texts()
"""Cache shared by all types, since the same frame names occur in many."""

_MOST_SHAPES = 4096
_LONGEST_SHAPE = 1024


class _Packers(dict[Any, _T]):
    """Packers of one run of fields with strings in it, by the lengths of these strings.

    Once the lengths are known, the run has a fixed layout, so that one call of ``struct`` packs it.

    Args:
        codes: Codes of ``struct`` in order, separated by blanks; ``$`` for a string's bytes,
            ``|4`` for padding.
        start: Offset of the run from the end of the header modulo 8, -4 for the header itself, or
            None where it varies; then it is the first part of the key.
        full: Largest alignment in the message, where the offset behind the run is needed: each
            packer comes with that offset modulo this.
    """

    __slots__ = ("_codes", "_full", "_start")

    def __init__(self, codes: str, start: int | None, full: int = 0) -> None:
        super().__init__()
        self._codes = codes.split()
        self._start = start
        self._full = full

    def __missing__(self, key: Any) -> _T:
        numbers = list(key) if isinstance(key, tuple) else [key]
        offset = numbers.pop(0) if self._start is None else self._start
        layout = ["<"]
        for code in self._codes:
            if code[0] == "|":
                one, alignment = "", int(code[1:])
            else:
                one = f"{numbers.pop(0)}s" if code == "$" else code
                alignment = 1 if one[-1] == "s" else struct.calcsize(one[-1])
            padding = -offset % alignment
            offset += padding + struct.calcsize("<" + one)
            layout.append(f"{padding}x{one}" if padding else one)
        pack = struct.Struct("".join(layout)).pack
        entry: Any = (pack, offset % self._full) if self._full else pack
        if offset <= _LONGEST_SHAPE:
            if len(self) >= _MOST_SHAPES:
                self.clear()
            self[key] = entry
        found: _T = entry
        return found


Template: TypeAlias = _Packers[Callable[..., bytes]]
"""Packers alone, where the offset behind the run is known or does not matter."""

Stride: TypeAlias = _Packers[tuple[Callable[..., bytes], int]]
"""Packers with the offset behind the run."""


def read_flags(octets: bytes) -> list[bool]:
    """Return octets as truth values."""
    return memoryview(octets).cast("?").tolist() if octets else []  # type: ignore[return-value]


def read_block(code: str, data: bytes, start: int, end: int) -> array[Any]:
    """Return many numbers, with one copy less than ``array(code, data)`` makes.

    Raises:
        ValueError: The bytes end too early, or in the middle of a number.
    """
    block = array(code)
    block.frombytes(memoryview(data)[start:end])
    return block
