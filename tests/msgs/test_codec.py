"""Generated codecs against the plain reference codec of the tests."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rosz.idl import MessageSpec
from rosz.message import Message, slots
from rosz.message.schema_codec import decode_plainly, encode_plainly
from rosz.typestore import TypeStore

from . import reference, values
from .invented import Invented

STORE = TypeStore()
CATALOG = STORE._catalog


def types() -> list[tuple[str, type[Message], MessageSpec]]:
    found = []
    for name in STORE.names("msg"):
        cls = STORE.message(name)
        found.append((name, cls, CATALOG.message(cls._type_name)))
    for name in STORE.names("srv"):
        service = STORE.service(name)
        spec = CATALOG.service(service._type_name)
        found.append((f"{name}Request", service.Request, spec.request))
        found.append((f"{name}Response", service.Response, spec.response))
    return found


TYPES = types()


@pytest.mark.usefixtures("fast_only")
@pytest.mark.parametrize(("cls", "spec"), [pytest.param(c, s, id=n) for n, c, s in TYPES])
def test_every_shipped_type(cls: type[Message], spec: MessageSpec) -> None:
    rng = random.Random(spec.name)
    for _ in range(8):
        plain = values.value(rng, CATALOG, spec)
        expected = reference.encode(CATALOG, spec, plain)
        message = values.build(cls, plain)
        assert message.to_cdr() == expected
        decoded = cls.from_cdr(expected)
        assert values.same(values.plain(decoded), plain)
        assert decoded.to_cdr() == expected
        assert values.same(reference.decode(CATALOG, spec, expected), plain)


@pytest.mark.parametrize(("cls", "spec"), [pytest.param(c, s, id=n) for n, c, s in TYPES])
def test_the_plain_codec_and_big_endian(cls: type[Message], spec: MessageSpec) -> None:
    rng = random.Random(spec.name + "plain")
    for _ in range(2):
        plain = values.value(rng, CATALOG, spec)
        message = values.build(cls, plain)
        little = reference.encode(CATALOG, spec, plain)
        big = reference.encode(CATALOG, spec, plain, ">")
        assert encode_plainly(message, cls) == little
        assert values.same(values.plain(decode_plainly(little, cls)), plain)
        assert values.same(values.plain(cls.from_cdr(big)), plain)
        assert cls.from_cdr(big).to_cdr() == little


def test_defaults_can_be_sent() -> None:
    for name, cls, _ in TYPES:
        assert values.plain(cls.from_cdr(cls().to_cdr())) == values.plain(cls()), name


@settings(max_examples=60)
@given(st.integers(0, 1 << 62))
def test_invented_types(seed: int) -> None:
    rng = random.Random(seed)
    invented = Invented(rng, 5)
    catalog = invented.catalog
    invented.module._plain = invented.module._explain = None  # not callable: nothing falls back
    for name in invented.texts:
        spec, cls = catalog.message(name), invented.cls(name)
        for _ in range(4):
            plain = values.value(rng, catalog, spec)
            expected = reference.encode(catalog, spec, plain)
            assert cls._encode(values.build(cls, plain)) == expected
            decoded = cls._decode(expected)
            assert values.same(values.plain(decoded), plain)
            assert cls._encode(decoded) == expected
            big = reference.encode(catalog, spec, plain, ">")
            assert values.same(values.plain(decode_plainly(big, cls)), plain)
            assert encode_plainly(decoded, cls) == expected


def as_numpy(message: Any) -> Any:
    """Replace numeric sequences by numpy arrays."""
    cls: Any = type(message)
    for slot in slots(cls):
        value = getattr(message, slot.name)
        if isinstance(value, Message):
            as_numpy(value)
        elif isinstance(slot.kind, type) and slot.shape != "one":
            for element in value:
                as_numpy(element)
        elif hasattr(value, "typecode"):
            setattr(message, slot.name, np.array(value, value.typecode))
        elif isinstance(value, bytes):
            setattr(message, slot.name, np.frombuffer(value, np.uint8))
        elif slot.kind == "bool" and slot.shape != "one":
            setattr(message, slot.name, np.array(value, bool))
    return message


@pytest.mark.usefixtures("fast_only")
def test_numpy_arrays_need_no_conversion() -> None:
    rng = random.Random(1)
    for _, cls, spec in TYPES:
        plain = values.value(rng, CATALOG, spec)
        expected = reference.encode(CATALOG, spec, plain)
        assert as_numpy(cls.from_cdr(expected)).to_cdr() == expected


@pytest.mark.parametrize("kind", [bytes, bytearray, memoryview])
def test_any_buffer_is_decoded(kind: type) -> None:
    cls = STORE.message("sensor_msgs/JointState")
    data = cls().to_cdr()
    assert values.plain(cls.from_cdr(kind(data))) == values.plain(cls())


def test_trailing_bytes_are_none_of_our_business() -> None:
    cls = STORE.message("geometry_msgs/Twist")
    assert cls.from_cdr(cls().to_cdr() + b"\0\0\0") == cls()
    text = STORE.message("std_msgs/String")
    assert text.from_cdr(text().to_cdr() + b"\0\0\0") == text()


def test_options_of_the_header_are_ignored() -> None:
    """XCDR2 writers say there how much padding follows."""
    cls = STORE.message("geometry_msgs/Twist")
    assert cls.from_cdr(b"\0\1\0\3" + cls().to_cdr()[4:]) == cls()
