"""What is known about offsets when code is generated.

XCDR1 aligns a primitive to its own size, at most 8, counted from the first byte after the header. A
:class:`Phase` is what is known about an offset modulo a power of two; behind a string little is
known, behind an aligned double all that matters.
"""

from __future__ import annotations

import struct
from typing import TypeAlias

import msgspec

from rosz.idl.catalog import Catalog
from rosz.idl.spec import FieldType, MessageSpec

__all__ = ("ALIGNED", "ARRAYS", "CODES", "OCTETS", "Layout", "Phase", "in_run", "size_of", "widest")

CODES = {
    "bool": "?",
    "byte": "B",
    "char": "B",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
OCTETS = frozenset({"byte", "char", "uint8"})
ARRAYS = {kind: code for kind, code in CODES.items() if kind not in OCTETS and kind != "bool"}
ALIGNED = 8
"""What alignments repeat after."""

_SHORT = 64

Leaf: TypeAlias = tuple[tuple[str, ...], str]


def size_of(code: str) -> int:
    """Return the size in bytes of one primitive, which is its alignment too."""
    return struct.calcsize("<" + code)


class Phase(msgspec.Struct, frozen=True):
    """An offset is ``rest`` modulo ``modulus``, a power of two up to 8."""

    modulus: int
    rest: int

    def padding(self, alignment: int) -> int | None:
        """Return the padding to an alignment, or None where it is only known at run time."""
        return -self.rest % alignment if alignment <= self.modulus else None

    def plus(self, size: int) -> Phase:
        """Return the phase so many bytes on."""
        return Phase(self.modulus, (self.rest + size) % self.modulus)

    def aligned(self, alignment: int) -> Phase:
        """Return the phase after padding to an alignment."""
        padding = self.padding(alignment)
        return Phase(alignment, 0) if padding is None else self.plus(padding)

    def plus_multiple(self, size: int) -> Phase:
        """Return the phase after an unknown number of elements of a size."""
        modulus = min(self.modulus, size & -size)
        return Phase(modulus, self.rest % modulus)

    def meet(self, other: Phase) -> Phase:
        """Return what is known when either may be the case."""
        modulus = min(self.modulus, other.modulus)
        while (self.rest - other.rest) % modulus:
            modulus //= 2
        return Phase(modulus, self.rest % modulus)


class Layout(msgspec.Struct, frozen=True):
    """How elements of a sequence lie that all look alike.

    Attributes:
        leaves: The primitives in an element: the attributes that lead to it, and its code.
        form: Format of one element.
        size: Bytes of one element.
    """

    leaves: tuple[Leaf, ...]
    form: str
    size: int

    @classmethod
    def of(cls, spec: MessageSpec, catalog: Catalog, start: Phase) -> Layout | None:
        """Lay out a message.

        Args:
            spec: The message.
            catalog: Where the types in it are.
            start: What is known about the offset of the first element.

        Returns:
            None where elements differ in size or padding.
        """
        leaves = _leaves(spec, catalog, ())
        if leaves is None:
            return None
        if not leaves:
            return cls((), "<x", 1)
        largest = max(size_of(code) for _, code in leaves)
        begin = phase = start.aligned(size_of(leaves[0][1]))
        if phase.modulus < largest:
            return None
        form = ["<"]
        size = 0
        for _, code in leaves:
            padding = phase.padding(size_of(code)) or 0
            form.append(f"{padding}x{code}" if padding else code)
            size += padding + size_of(code)
            phase = phase.plus(padding + size_of(code))
        if (phase.rest - begin.rest) % largest:
            return None
        return cls(tuple(leaves), "".join(form), size)


def _leaves(spec: MessageSpec, catalog: Catalog, path: tuple[str, ...]) -> list[Leaf] | None:
    leaves: list[Leaf] = []
    for field in spec.fields:
        kind = field.type
        if kind.shape != "one" or kind.base in ("string", "wstring"):
            return None
        if kind.primitive:
            leaves.append(((*path, field.name), CODES[kind.base]))
            continue
        below = _leaves(catalog.message(kind.base), catalog, (*path, field.name))
        if not below:
            return None
        leaves += below
    return leaves


def widest(spec: MessageSpec, catalog: Catalog) -> int:
    """Return the largest alignment in a message."""
    largest = 1
    for field in spec.fields:
        kind = field.type
        if kind.counted or kind.base in ("string", "wstring"):
            largest = max(largest, 4)
        if kind.base in CODES:
            largest = max(largest, size_of(CODES[kind.base]))
        elif not kind.primitive:
            largest = max(largest, widest(catalog.message(kind.base), catalog))
    return largest


def in_run(kind: FieldType) -> bool:
    """Tell whether a field is a short block of octets that one ``struct`` code holds."""
    return kind.shape == "fixed" and kind.base in OCTETS and kind.size <= _SHORT
