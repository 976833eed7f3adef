"""Damaged bytes give a value or a DecodeError, whatever they are, at the cost of their own size.

``ROSZ_FUZZ`` is the number of inputs.
"""

from __future__ import annotations

import os
import random
import struct
import tracemalloc
from typing import Any

import pytest

from rosz.errors import DecodeError
from rosz.message import Message
from rosz.message.schema_codec import decode_plainly

from . import reference, values
from .invented import Invented
from .test_codec import CATALOG, TYPES

INPUTS = int(os.environ.get("ROSZ_FUZZ", "1000000"))
SHARDS = 8
HUGE = (0xFFFFFFFF, 0x80000000, 0x7FFFFFFF, 0x10000000, 65536, 1000, 255)


def damage(rng: random.Random, data: bytes) -> bytes:
    """Return bytes with something wrong in them, most of the time."""
    damaged = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        at = rng.randrange(len(damaged)) if damaged else 0
        kind = rng.randrange(6)
        if kind == 0:
            del damaged[at:]
        elif kind == 1 and damaged:
            damaged[at] = rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))
        elif kind == 2:
            word = at & ~3
            damaged[word : word + 4] = struct.pack("<I", rng.choice(HUGE))
        elif kind == 3:
            del damaged[at : at + rng.randrange(1, 9)]
        elif kind == 4:
            damaged[at:at] = rng.randbytes(rng.randrange(1, 9))
        else:
            damaged += rng.randbytes(rng.randrange(9))
    return bytes(damaged)


def check(cls: type[Message], data: bytes) -> bool:
    """Decode, and tell whether it was refused."""
    try:
        message: Any = cls.from_cdr(data)
    except DecodeError as error:
        refusal = error
    else:
        assert type(message) is cls
        return False
    assert refusal.type_name == cls._type
    assert 0 <= refusal.offset <= len(data)
    assert refusal.reason
    return True


@pytest.mark.timeout(1200)
@pytest.mark.parametrize("shard", range(SHARDS))
def test_a_value_or_a_decode_error(shard: int) -> None:
    rng = random.Random(shard)
    refused = 0
    count = 0
    while count < INPUTS // SHARDS:
        _, cls, spec = rng.choice(TYPES)
        data = reference.encode(CATALOG, spec, values.value(rng, CATALOG, spec), rng.choice("<<<>"))
        for _ in range(20):
            refused += check(cls, damage(rng, data))
            count += 1
    assert count / 20 < refused < count


@pytest.mark.parametrize("seed", range(25))
def test_invented_types(seed: int) -> None:
    """The shipped types have hardly any bounds and no wide strings."""
    rng = random.Random(seed)
    invented = Invented(rng, 6)
    for name in invented.texts:
        spec, cls = invented.catalog.message(name), invented.cls(name)
        for _ in range(10):
            plain = values.value(rng, invented.catalog, spec)
            data = reference.encode(invented.catalog, spec, plain)
            for _ in range(10):
                compare(cls, damage(rng, data))


@pytest.mark.parametrize("order", "<>")
def test_every_truncation(order: str) -> None:
    rng = random.Random(1)
    for name, cls, spec in TYPES:
        data = reference.encode(CATALOG, spec, values.value(rng, CATALOG, spec), order)
        whole = data[:-1] + b"\0"  # an empty message is its one byte, of any value
        cls.from_cdr(whole if spec.fields else data)
        for end in range(0, len(data), max(len(data) // 50, 1)):
            assert check(cls, data[:end]), (name, end)


@pytest.mark.parametrize("size", [0, 1, 4, 5, 8, 100, 3000])
def test_noise(size: int) -> None:
    rng = random.Random(size)
    for _, cls, _ in TYPES:
        check(cls, rng.randbytes(size))
        check(cls, b"\0\1\0\0" + rng.randbytes(size))
        check(cls, b"\0\1\0\0" + b"\xff" * size)


@pytest.mark.parametrize("length", HUGE[:3])
def test_a_length_alone_allocates_nothing(length: int) -> None:
    """Put a huge number in place of every count and length there is."""
    tracemalloc.start()
    try:
        for name, cls, _ in TYPES:
            data = cls().to_cdr()
            for at in range(4, len(data) - 3, 4):
                broken = data[:at] + struct.pack("<I", length) + data[at + 4 :]
                # Threads that other tests have left behind allocate too, but not each time.
                assert any(allocated(cls, broken) < 100_000 for _ in range(5)), (name, at)
    finally:
        tracemalloc.stop()


def allocated(cls: type[Message], data: bytes) -> int:
    """Return how many bytes it takes at most to refuse a message."""
    tracemalloc.reset_peak()
    before, _ = tracemalloc.get_traced_memory()
    check(cls, data)
    _, peak = tracemalloc.get_traced_memory()
    return peak - before


DAMAGED: list[tuple[str, str, str]] = [
    ("std_msgs/String", "", "std_msgs/String at byte 0: expected a header of 4 bytes, got 0"),
    ("std_msgs/String", "000100", "std_msgs/String at byte 0: expected a header of 4 bytes, got 3"),
    (
        "std_msgs/String",
        "00020000",
        "std_msgs/String at byte 0: expected encapsulation 0x0000 or 0x0001 (CDR), got 0x0002",
    ),
    (
        "std_msgs/String",
        "0001000005000000616200",
        "std_msgs/String at byte 8: data: expected a string (5 bytes), 3 left",
    ),
    (
        "std_msgs/String",
        "0001000002000000ff00",
        "std_msgs/String at byte 10: data: not a valid string: 'utf-8' codec can't decode byte 0x",
    ),
    (
        "geometry_msgs/Twist",
        "00010000" + "00" * 44,
        "geometry_msgs/Twist at byte 44: angular.z: expected float64 (8 bytes), 4 left",
    ),
    (
        "geometry_msgs/PoseArray",
        "00010000" + "00" * 8 + "0100000000000000" + "ffffff7f",
        "geometry_msgs/PoseArray at byte 24: poses: expected 2147483647 elements, 0 bytes left",
    ),
    (
        "sensor_msgs/LaserScan",
        "00010000" + "00" * 8 + "0100000000000000" + "00" * 28 + "03000000" + "00" * 8,
        "sensor_msgs/LaserScan at byte 52: ranges: expected 3 elements of float32 (12 bytes), 8",
    ),
    (
        "rcl_interfaces/ParameterDescriptor",
        "00010000" + "0100000000000000" + "0100000000000000" + "01000000000000000200000000000000",
        "rcl_interfaces/ParameterDescriptor at byte 32: floating_point_range: expected at most 1"
        " elements, got 2",
    ),
    (
        "diagnostic_msgs/DiagnosticArray",
        "00010000" + "00" * 8 + "01000000" + "00000000" + "02000000" + "00" * 4,
        "diagnostic_msgs/DiagnosticArray at byte 28: status[0].name: expected uint32 (4 bytes), 0",
    ),
]


@pytest.mark.parametrize(("name", "data", "expected"), DAMAGED)
def test_what_is_wrong_and_where(name: str, data: str, expected: str) -> None:
    cls = next(cls for known, cls, _ in TYPES if known == name)
    with pytest.raises(DecodeError) as caught:
        cls.from_cdr(bytes.fromhex(data))
    assert str(caught.value).startswith(expected)
    assert caught.value.__suppress_context__


def compare(cls: type[Message], data: bytes) -> None:
    """Have the fast path and the plain codec refuse the same, and give the same values."""
    try:
        plain: Any = values.plain(decode_plainly(data, cls))
    except DecodeError:
        plain = None
    try:
        fast: Any = values.plain(cls._decode(data))
    except DecodeError:
        fast = None
    assert (plain is None) == (fast is None), (cls, data.hex())
    assert plain is None or values.same(plain, fast), (cls, data.hex())


def test_the_plain_codec_agrees_on_what_is_damaged() -> None:
    rng = random.Random(7)
    for _ in range(6000):
        _, cls, spec = rng.choice(TYPES)
        compare(cls, damage(rng, reference.encode(CATALOG, spec, values.value(rng, CATALOG, spec))))
