"""Offsets and layouts, as far as the code generator knows them.

XCDR1 aligns a primitive to its own size, at most 8, counted from the first byte after the header. A
:class:`Phase` is what is known about an offset modulo a power of two: little behind a string,
everything behind an aligned double.
"""

from __future__ import annotations

import re
import struct
from typing import TypeAlias

import msgspec

from rosz.idl.catalog import Catalog
from rosz.idl.spec import FieldType, MessageSpec
from rosz.message import OCTETS, SCALAR_CODES

__all__ = ("MAX_ALIGNMENT", "Layout", "Phase", "in_run", "join_codes", "size_of", "widest")

MAX_ALIGNMENT = 8
"""The largest alignment; what is known of an offset repeats after it."""

_SHORT = 64

Leaf: TypeAlias = tuple[tuple[str, ...], str]


def size_of(code: str) -> int:
    """Return the size of a primitive in bytes, which is also its alignment."""
    return struct.calcsize("<" + code)


class Phase(msgspec.Struct, frozen=True):
    """An offset is ``rest`` modulo ``modulus``, a power of two up to 8."""

    modulus: int
    rest: int

    def padding(self, alignment: int) -> int | None:
        """Return the padding to an alignment; None where only the run time knows it."""
        return -self.rest % alignment if alignment <= self.modulus else None

    def plus(self, size: int) -> Phase:
        """Return the phase a number of bytes later."""
        return Phase(self.modulus, (self.rest + size) % self.modulus)

    def aligned(self, alignment: int) -> Phase:
        """Return the phase after padding to an alignment."""
        padding = self.padding(alignment)
        return Phase(alignment, 0) if padding is None else self.plus(padding)

    def plus_multiple(self, size: int) -> Phase:
        """Return the phase after an unknown number of elements of a size."""
        modulus = min(self.modulus, size & -size)
        return Phase(modulus, self.rest % modulus)

    def common(self, other: Phase) -> Phase:
        """Return what is known when either phase may be true."""
        modulus = min(self.modulus, other.modulus)
        while (self.rest - other.rest) % modulus:
            modulus //= 2
        return Phase(modulus, self.rest % modulus)


class Layout(msgspec.Struct, frozen=True):
    """The layout of the elements of a sequence that all have the same one.

    Attributes:
        leaves: The primitives of an element, each as its attribute path and its struct code.
        form: Struct format of one element.
        size: Size of one element in bytes.
    """

    leaves: tuple[Leaf, ...]
    form: str
    size: int

    @classmethod
    def of(cls, spec: MessageSpec, catalog: Catalog, start: Phase) -> Layout | None:
        """Return the layout of a message, or None where elements differ in size or padding.

        Args:
            spec: The message.
            catalog: Specs of the types in it.
            start: Phase of the first element.
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
            leaves.append(((*path, field.name), SCALAR_CODES[kind.base]))
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
        if kind.base in SCALAR_CODES:
            largest = max(largest, size_of(SCALAR_CODES[kind.base]))
        elif not kind.primitive:
            largest = max(largest, widest(catalog.message(kind.base), catalog))
    return largest


def in_run(kind: FieldType) -> bool:
    """Return whether a field is a short array of octets, which one struct code holds."""
    return kind.shape == "fixed" and kind.base in OCTETS and kind.size <= _SHORT


def join_codes(layout: list[str]) -> str:
    """Return a format with equal neighbours as a count: ``<ddd`` becomes ``<3d``."""
    merged: list[tuple[int, str]] = []
    for number, code in re.findall(r"(\d*)(\D)", "".join(layout)):
        count = int(number or 1)
        if merged and merged[-1][1] == code and code not in "sx<":
            merged[-1] = (merged[-1][0] + count, code)
        else:
            merged.append((count, code))
    return "".join(c if n == 1 and c != "s" else f"{n}{c}" for n, c in merged)
