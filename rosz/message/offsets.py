"""Offsets in a message, as far as they are known when code is generated.

A :class:`Phase` is an offset modulo a power of two. That power is small behind a string, and the
largest alignment behind an aligned double. In ROS 1's layout nothing is aligned, so it is 1.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from typing import Any, TypeAlias

import msgspec

from rosz.message.layout import ByteLayout
from rosz.message.schema import OCTETS, SCALAR_CODES, Slot

_SHORT = 64  # octets; more of them are a piece of their own, which a run need not copy

Fields: TypeAlias = Callable[[Any], tuple[Slot, ...]]
Leaf: TypeAlias = tuple[tuple[str, ...], str]


def size_of(code: str) -> int:
    """Return the size of a struct code in bytes."""
    return struct.calcsize("<" + code)


def alignment_of(code: str, layout: ByteLayout) -> int:
    """Return the alignment of a struct code; ``$`` is a string, ``|4`` padding to that."""
    if code[0] == "|":
        return int(code[1:])
    return 1 if code[0] == "$" or code[-1] in "sx" else layout.limit(size_of(code))


class Phase(msgspec.Struct, frozen=True):
    """An offset is ``rest`` modulo ``modulus``, a power of two up to the largest alignment."""

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

    def plus_elements(self, count: str, size: int) -> Phase:
        """Return the phase behind elements of a size; their number is constant or an expression."""
        if count.isdigit() or not size:
            return self.plus(int(count) * size if size else 0)
        modulus = min(self.modulus, size & -size)
        return Phase(modulus, self.rest % modulus)

    def common(self, other: Phase) -> Phase:
        """Return the phase that holds when either of two may be true."""
        modulus = min(self.modulus, other.modulus)
        while (self.rest - other.rest) % modulus:
            modulus //= 2
        return Phase(modulus, self.rest % modulus)


class Elements(msgspec.Struct, frozen=True):
    """The elements of a sequence that all have the same layout.

    Attributes:
        leaves: The primitives of an element, each as its attribute path and its struct code.
        form: Struct format of one element.
        size: Size of one element in bytes.
        alignment: Alignment of the first one.
    """

    leaves: tuple[Leaf, ...]
    form: str
    size: int
    alignment: int

    @classmethod
    def of(cls, kind: Any, fields: Fields, layout: ByteLayout, start: Phase) -> Elements | None:
        """Return the elements of a type, or None where they differ in size or padding.

        Args:
            kind: The type of the elements.
            fields: Function that returns the fields of a message type.
            layout: The byte layout.
            start: Phase of the first element.
        """
        leaves = None if isinstance(kind, str) else _leaves(kind, fields, layout, ())
        if leaves is None:
            return None
        if not leaves:
            return cls((), "<" + "x" * layout.empty, layout.empty, 1)
        alignments = [alignment_of(code, layout) for _, code in leaves]
        begin = phase = start.aligned(alignments[0])
        if phase.modulus < max(alignments):
            return None
        form = ["<"]
        size = 0
        for (_, code), alignment in zip(leaves, alignments, strict=True):
            padding = phase.padding(alignment) or 0
            form.append(f"{padding}x{code}" if padding else code)
            size += padding + size_of(code)
            phase = phase.plus(padding + size_of(code))
        if (phase.rest - begin.rest) % max(alignments):
            return None
        return cls(tuple(leaves), join_codes(form), size, alignments[0])


def _leaves(
    kind: Any, fields: Fields, layout: ByteLayout, path: tuple[str, ...]
) -> list[Leaf] | None:
    leaves: list[Leaf] = []
    for slot in fields(kind):
        if slot.shape != "one" or slot.kind in ("string", "wstring"):
            return None
        if isinstance(slot.kind, str):
            leaves.append(((*path, slot.name), SCALAR_CODES[slot.kind]))
            continue
        below = _leaves(slot.kind, fields, layout, (*path, slot.name))
        if below is None or (not below and layout.empty):
            return None
        leaves += below
    return leaves


class Walk(msgspec.Struct, frozen=True):
    """Follows the phase through fields, without generating code.

    Args:
        fields: Function that returns the fields of a message type.
        layout: The byte layout.
    """

    fields: Fields
    layout: ByteLayout

    def steady(self, slot: Slot, phase: Phase) -> Phase:
        """Return the phase at the head of a loop, before the first and after any element."""
        while True:
            both = phase.common(self._one(slot, phase))
            if both == phase:
                return phase
            phase = both

    def _one(self, slot: Slot, phase: Phase) -> Phase:
        kind = slot.kind
        if isinstance(kind, str):
            if kind in SCALAR_CODES:
                return self._number(SCALAR_CODES[kind], phase)
            return self._number("I", phase).plus_elements("n", 1 if kind == "string" else 4)
        fields = self.fields(kind)
        for below in fields:
            phase = self._one(below, phase) if below.shape == "one" else self._many(below, phase)
        return phase if fields else phase.plus(self.layout.empty)

    def _number(self, code: str, phase: Phase) -> Phase:
        return phase.aligned(alignment_of(code, self.layout)).plus(size_of(code))

    def _many(self, slot: Slot, phase: Phase) -> Phase:
        kind = slot.kind
        if kind == "string":
            return phase.aligned(self.layout.limit(4)).plus_elements("n", 1)
        count = str(slot.size)
        if slot.counted:
            count = "n"
            phase = self._number("I", phase)
        if isinstance(kind, str) and kind in SCALAR_CODES:
            size = size_of(SCALAR_CODES[kind])
            return self._elements(count, self.layout.limit(size), size, phase)
        alike = Elements.of(kind, self.fields, self.layout, phase)
        if alike is not None:
            return self._elements(count, alike.alignment, alike.size, phase)
        return self.steady(slot, phase)

    def _elements(self, count: str, alignment: int, size: int, phase: Phase) -> Phase:
        aligned = phase.aligned(alignment)
        if not count.isdigit():  # an empty sequence has no padding
            aligned = aligned.common(phase)
        return aligned.plus_elements(count, size)


def widest(kind: Any, fields: Fields) -> int:
    """Return the size of the largest number in a message, lengths included."""
    largest = 1
    for slot in fields(kind):
        if slot.counted or slot.kind in ("string", "wstring"):
            largest = max(largest, 4)
        if isinstance(slot.kind, str):
            largest = max(largest, size_of(SCALAR_CODES.get(slot.kind, "x")))
        else:
            largest = max(largest, widest(slot.kind, fields))
    return largest


def in_run(slot: Slot) -> bool:
    """Return whether a field is a short array of octets, which one struct code holds."""
    return slot.shape == "fixed" and slot.kind in OCTETS and slot.size <= _SHORT


def join_codes(codes: list[str]) -> str:
    """Return a format with equal neighbours as a count: ``<ddd`` becomes ``<3d``."""
    merged: list[tuple[int, str]] = []
    for number, code in re.findall(r"(\d*)(\D)", "".join(codes)):
        count = int(number or 1)
        if merged and merged[-1][1] == code and code not in "sx<":
            merged[-1] = (merged[-1][0] + count, code)
        else:
            merged.append((count, code))
    return "".join(c if n == 1 and c != "s" else f"{n}{c}" for n, c in merged)
