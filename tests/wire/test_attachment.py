from __future__ import annotations

import pytest

from rosz.errors import DecodeError
from rosz.wire import pack_attachment, read_attachment

GID = bytes(range(1, 17))
BYTES = bytes.fromhex("010000000000000015cd853dfe9c9717100102030405060708090a0b0c0d0e0f10")
OLD_LAYOUT = bytes.fromhex(
    "0f73657175656e63655f6e756d626572010000000000000010736f757263655f74696d657374616d70"
    "15cd853dfe9c97170a736f757263655f676964100102030405060708090a0b0c0d0e0f10"
)


def test_both_ways() -> None:
    assert pack_attachment(1, 1700000000123456789, GID) == BYTES
    assert read_attachment(BYTES) == (1, 1700000000123456789, GID)


def test_equals_zenohs_own_serialization() -> None:
    from zenoh.ext import Int64, z_serialize

    value = (Int64(7), Int64(1700000000123456789), GID)
    assert z_serialize(value).to_bytes() == pack_attachment(7, 1700000000123456789, GID)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (None, "missing"),
        (b"", "0 bytes, expected 33"),
        (OLD_LAYOUT, "rmw_zenoh before 0.2.5"),
        (BYTES[:16] + b"\x11" + BYTES[17:], "a GID of 17 bytes"),
    ],
)
def test_damage(data: bytes | None, reason: str) -> None:
    with pytest.raises(DecodeError, match=reason):
        read_attachment(data)
