"""What is known about offsets when code is generated.

XCDR1 aligns a primitive to its own size, at most 8, counted from the first byte after the header. A
:class:`Phase` is what is known about an offset modulo a power of two; behind a string little is
known, behind an aligned double all that matters.
"""

from __future__ import annotations

import struct

import msgspec

from rosz.idl.catalog import Catalog
from rosz.idl.spec import FieldType, MessageSpec

__all__ = ("ALIGNED", "ARRAYS", "CODES", "OCTETS", "Phase", "fixed_layout", "in_run", "size_of")

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


def fixed_layout(
    spec: MessageSpec, catalog: Catalog, start: Phase
) -> tuple[list[tuple[tuple[str, ...], str]], str, int] | None:
    """Lay out a message whose elements in a sequence all look alike.

    Args:
        spec: The message.
        catalog: Where the types in it are.
        start: What is known about the offset of the first element.

    Returns:
        Paths and codes of its primitives, the format of one element, its size; None where elements
        differ in size or padding.
    """
    leaves = _leaves(spec, catalog, ())
    if leaves is None:
        return None
    alignments = [size_of(code) for _, code in leaves if code[-1] != "s"] or [1]
    phase = start.aligned(alignments[0] if leaves and leaves[0][1][-1] != "s" else 1)
    if phase.modulus < max(alignments):
        return None
    begin = phase
    layout = ["<"]
    size = 0
    for _, code in leaves:
        padding = phase.padding(1 if code[-1] == "s" else size_of(code)) or 0
        width = size_of(code)
        layout.append(f"{padding}x{code}" if padding else code)
        phase = phase.plus(padding + width)
        size += padding + width
    if not leaves:
        layout.append("x")
        size = 1
        phase = phase.plus(1)
    largest = max(alignments)
    if (phase.rest - begin.rest) % largest:
        return None
    return leaves, "".join(layout), size


def _leaves(
    spec: MessageSpec, catalog: Catalog, path: tuple[str, ...]
) -> list[tuple[tuple[str, ...], str]] | None:
    leaves: list[tuple[tuple[str, ...], str]] = []
    for field in spec.fields:
        kind = field.type
        if kind.shape == "one" and kind.base in CODES:
            leaves.append(((*path, field.name), CODES[kind.base]))
        elif kind.shape == "one" and not kind.primitive:
            below = _leaves(catalog.message(kind.base), catalog, (*path, field.name))
            if below is None or not below:
                return None
            leaves += below
        else:
            return None
    return leaves


def in_run(kind: FieldType) -> bool:
    """Tell whether a field is a short block of octets that one ``struct`` code holds."""
    return kind.shape == "fixed" and kind.base in OCTETS and kind.size <= _SHORT
