"""Random values of message types, and the way between plain values and message objects."""

from __future__ import annotations

import math
import random
import struct
import sys
from array import array
from typing import Any

from rosz.idl import Catalog, FieldType, MessageSpec
from rosz.message import Message, slots

from .reference import CODES, OCTETS

RANGES = {
    "b": (-(1 << 7), (1 << 7) - 1),
    "B": (0, (1 << 8) - 1),
    "h": (-(1 << 15), (1 << 15) - 1),
    "H": (0, (1 << 16) - 1),
    "i": (-(1 << 31), (1 << 31) - 1),
    "I": (0, (1 << 32) - 1),
    "q": (-(1 << 63), (1 << 63) - 1),
    "Q": (0, (1 << 64) - 1),
}
FLOATS = (0.0, -0.0, 1.0, -1.5, 0.1, math.inf, -math.inf, math.nan, 5e-324, sys.float_info.max)
TEXTS = ("", "a", "map", "base_link", "é€", "a longer text, with blanks", "\U0001f916", "x" * 40)


def single(rng: random.Random, catalog: Catalog, kind: FieldType) -> Any:
    if kind.base in ("string", "wstring"):
        text = rng.choice(TEXTS)
        size = "utf-16-le" if kind.base == "wstring" else "utf-8"
        while kind.bound and len(text.encode(size)) > kind.bound:
            text = text[:-1]
        return text
    if not kind.primitive:
        return value(rng, catalog, catalog.message(kind.base))
    code = CODES[kind.base]
    if code == "?":
        return rng.random() < 0.5
    if code in "fd":
        number = rng.choice((*FLOATS, rng.uniform(-1e6, 1e6)))
        try:
            return struct.unpack(code, struct.pack(code, number))[0]
        except OverflowError:
            return math.inf
    low, high = RANGES[code]
    return rng.choice((low, high, 0, 1, rng.randint(low, high)))


def value(rng: random.Random, catalog: Catalog, spec: MessageSpec) -> dict[str, Any]:
    """Return a random value as dicts, lists and bytes."""
    result: dict[str, Any] = {}
    for field in spec.fields:
        kind = field.type
        if kind.shape == "one":
            result[field.name] = single(rng, catalog, kind)
            continue
        most = kind.size if kind.shape == "bounded" else rng.choice((0, 1, 2, 5))
        count = kind.size if kind.shape == "fixed" else rng.randint(0, most)
        elements = [single(rng, catalog, kind) for _ in range(count)]
        result[field.name] = bytes(elements) if kind.base in OCTETS else elements
    return result


def build(cls: type[Message], plain: dict[str, Any]) -> Message:
    """Turn a plain value into a message, as a caller would write it: with lists."""
    members: dict[str, Any] = {}
    for slot in slots(cls):
        member = plain[slot.name.rstrip("_") if slot.name not in plain else slot.name]
        if isinstance(slot.kind, str):
            members[slot.name] = member
        elif slot.shape == "one":
            members[slot.name] = build(slot.kind, member)
        else:
            members[slot.name] = [build(slot.kind, element) for element in member]
    return cls(**members)


def plain(message: Any) -> Any:
    """Turn a message into a plain value."""
    if isinstance(message, Message):
        return {slot.name: plain(getattr(message, slot.name)) for slot in slots(type(message))}
    if isinstance(message, array):
        return message.tolist()
    if isinstance(message, list):
        return [plain(element) for element in message]
    return message


def same(left: Any, right: Any) -> bool:
    """Compare plain values; NaN equals NaN, and 0.0 is not -0.0."""
    if isinstance(left, dict):
        return left.keys() == right.keys() and all(same(left[k], right[k]) for k in left)
    if isinstance(left, list):
        return len(left) == len(right) and all(map(same, left, right))
    if isinstance(left, float):
        return struct.pack("d", left) == struct.pack("d", right)
    return bool(type(left) is type(right) and left == right)
