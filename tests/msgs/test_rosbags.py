"""Both directions against rosbags, over every shipped type that it knows."""

from __future__ import annotations

import random
from functools import partial
from typing import Any

import numpy as np
import pytest

from rosz.idl import Catalog, MessageSpec
from rosz.message import Message
from rosz.typestore import TypeStore

from . import reference, values

pytest.importorskip("rosbags.typesys", reason="needs rosbags")

from rosbags.typesys import Stores, get_typestore

THEIRS: Any = get_typestore(Stores.ROS2_JAZZY)
STORE = TypeStore()
CATALOG = STORE._catalog


def known() -> list[str]:
    names = []
    for name in STORE.names("msg"):
        full = STORE.message(name)._type_name
        if full in THEIRS.types:
            names.append(full)
    return names


def build(
    spec: MessageSpec, plain: dict[str, Any], catalog: Catalog = CATALOG, theirs: Any = THEIRS
) -> Any:
    """Turn a plain value into a message of rosbags."""
    members = []
    for field in spec.fields:
        value, kind = plain[field.name], field.type
        if not kind.primitive:
            below = catalog.message(kind.base)
            built = partial(build, below, catalog=catalog, theirs=theirs)
            value = built(value) if kind.shape == "one" else [*map(built, value)]
        elif kind.shape != "one" and kind.base != "string":
            dtype = {"bool": "?", "B": "u1"}.get(kind.base, reference.CODES[kind.base])
            value = np.array(list(value), dtype.replace("B", "u1").replace("b", "i1"))
        elif kind.base == "byte":  # an int8 to rosbags, as it was to ROS 1
            value = (value ^ 0x80) - 0x80
        members.append(value)
    if not spec.fields:
        members.append(0)
    return theirs.types[spec.name](*members)


def unpacked(spec: MessageSpec, message: Any) -> dict[str, Any]:
    """Turn a message of rosbags into a plain value."""
    result: dict[str, Any] = {}
    for field in spec.fields:
        value, kind = getattr(message, field.name), field.type
        if not kind.primitive:
            below = CATALOG.message(kind.base)
            one = kind.shape == "one"
            value = unpacked(below, value) if one else [unpacked(below, e) for e in value]
        elif kind.shape != "one" and kind.base in reference.OCTETS:
            value = bytes(value)
        elif isinstance(value, np.ndarray):
            value = value.tolist()
        elif kind.base == "byte":
            value &= 0xFF
        result[field.name] = value
    return result


def test_most_types_are_known() -> None:
    assert len(known()) > 150


@pytest.mark.parametrize("name", known())
def test_both_directions(name: str) -> None:
    rng = random.Random(name)
    cls: type[Message] = STORE.message(name)
    spec = CATALOG.message(name)
    for _ in range(4):
        plain = values.value(rng, CATALOG, spec)
        theirs = bytes(THEIRS.serialize_cdr(build(spec, plain), name))
        ours = values.build(cls, plain).to_cdr()
        assert ours == theirs
        assert values.same(values.plain(cls.from_cdr(theirs)), plain)
        assert values.same(unpacked(spec, THEIRS.deserialize_cdr(ours, name)), plain)
        big = bytes(THEIRS.serialize_cdr(build(spec, plain), name, little_endian=False))
        assert values.same(values.plain(cls.from_cdr(big)), plain)
