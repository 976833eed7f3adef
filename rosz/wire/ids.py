"""Ids of entities and of sessions, and the attachments that carry them.

The GID of an entity is XXH3-128 of its liveliness token (rmw_zenoh). This implements only the
part for tokens: seed 0, and inputs of 17 bytes or more. The algorithm is specified in the xxHash
project's document "XXH3 algorithm overview".

Every publication, request and reply carries an attachment (rmw_zenoh): the sequence number and the
source time as little-endian 64-bit integers, and the GID after its length.

Zenoh's ids of sessions are up to 32 hexadecimal digits, and those of other programs are random. Ids
of rosz begin with a mark and a number for the host, and have none of the digits ``a`` to ``e``. So
key expressions that match one of these digits match the sessions of other programs: only 6 of a
million random ids have none of them.
"""

from __future__ import annotations

import zlib
from struct import Struct, unpack_from

from rosz.errors import DecodeError

FOREIGN_DIGITS = "abcde"
"""The digits that no id of rosz has."""

_MARK = "7052"
_HOST_DIGITS = 6
_DIGITS = 32

_M = (1 << 64) - 1
_P1, _P2, _P3 = 0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9
_P4, _P5 = 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5
_Q1, _Q2, _Q3 = 0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D
_MX = 0x165667919E3779F9
_SECRET = bytes.fromhex(
    "b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671fcb79e64eccc0e578825ad07dccff7221"
    "b8084674f743248ee03590e6813a264c3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8"
    "a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364eac5ac8334d3ebc3c581a0fffa1363eb"
    "170ddd51b7f0da49d316552629d4689e2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e"
)
_MEDIUM = 128
_LONG = 240
_STRIPE = 64
_STRIPES_PER_BLOCK = 16

_GID_SIZE = 16
_LAYOUT = Struct("<qqB16s")
_OLD_SIZE = 77
_pack = _LAYOUT.pack


def id_prefix(host: str) -> str:
    """Return the first ten digits of the ids of the sessions on a host."""
    return f"{_MARK}{zlib.crc32(host.encode()) % 10**_HOST_DIGITS:0{_HOST_DIGITS}d}"


def is_rosz_id(zid: str) -> bool:
    """Tell whether a session is one of rosz."""
    return len(zid) == _DIGITS and zid.startswith(_MARK) and not any(map(zid.count, FOREIGN_DIGITS))


def host_number(zid: str) -> str:
    """Return a number for the host of a session of rosz; one in a million hosts shares it."""
    return zid[len(_MARK) : len(_MARK) + _HOST_DIGITS]


def gid(token: str) -> bytes:
    """Return the GID of an entity, 16 bytes.

    Args:
        token: The liveliness token of the entity.
    """
    data = token.encode()
    low, high = _long(data) if len(data) > _LONG else _short(data)
    return low.to_bytes(8, "little") + high.to_bytes(8, "little")


def _word(data: bytes, offset: int) -> int:
    return int(unpack_from("<Q", data, offset)[0])


def _fold(a: int, b: int) -> int:
    product = a * b
    return (product & _M) ^ (product >> 64)


def _avalanche(value: int) -> int:
    value ^= value >> 37
    value = value * _MX & _M
    return value ^ (value >> 32)


def _mix(data: bytes, offset: int, secret: int) -> int:
    return _fold(
        _word(data, offset) ^ _word(_SECRET, secret),
        _word(data, offset + 8) ^ _word(_SECRET, secret + 8),
    )


def _short(data: bytes) -> tuple[int, int]:
    size = len(data)
    low, high = size * _P1 & _M, 0

    def pair(a: int, b: int, secret: int) -> None:
        nonlocal low, high
        low = (low + _mix(data, a, secret)) & _M
        low ^= (_word(data, b) + _word(data, b + 8)) & _M
        high = (high + _mix(data, b, secret + 16)) & _M
        high ^= (_word(data, a) + _word(data, a + 8)) & _M

    if size <= _MEDIUM:
        for k in range((size - 1) // 32, -1, -1):
            pair(16 * k, size - 16 * (k + 1), 32 * k)
    else:
        for k in range(4):
            pair(32 * k, 32 * k + 16, 32 * k)
        low, high = _avalanche(low), _avalanche(high)
        for k in range(4, size // 32):
            pair(32 * k, 32 * k + 16, 3 + 32 * (k - 4))
        pair(size - 16, size - 32, 103)
    mixed = (low * _P1 + high * _P4 + size * _P2) & _M
    return _avalanche((low + high) & _M), -_avalanche(mixed) & _M


def _long(data: bytes) -> tuple[int, int]:
    size = len(data)
    lanes = [_Q3, _P1, _P2, _P3, _P4, _Q2, _P5, _Q1]

    def stripe(offset: int, secret: int) -> None:
        for i in range(8):
            value = _word(data, offset + 8 * i)
            key = value ^ _word(_SECRET, secret + 8 * i)
            lanes[i ^ 1] = (lanes[i ^ 1] + value) & _M
            lanes[i] = (lanes[i] + (key & 0xFFFFFFFF) * (key >> 32)) & _M

    block = _STRIPE * _STRIPES_PER_BLOCK
    blocks = (size - 1) // block
    for b in range(blocks):
        for j in range(_STRIPES_PER_BLOCK):
            stripe(b * block + j * _STRIPE, 8 * j)
        for i in range(8):
            lane = lanes[i] ^ (lanes[i] >> 47) ^ _word(_SECRET, 128 + 8 * i)
            lanes[i] = lane * _Q1 & _M
    for j in range((size - 1 - block * blocks) // _STRIPE):
        stripe(blocks * block + j * _STRIPE, 8 * j)
    stripe(size - _STRIPE, 121)

    def merge(secret: int, start: int) -> int:
        total = start
        for i in range(4):
            total += _fold(
                lanes[2 * i] ^ _word(_SECRET, secret + 16 * i),
                lanes[2 * i + 1] ^ _word(_SECRET, secret + 16 * i + 8),
            )
        return _avalanche(total & _M)

    return merge(11, size * _P1 & _M), merge(117, ~(size * _P2) & _M)


def pack_attachment(sequence: int, source_time: int, gid: bytes) -> bytes:
    """Return the 33 bytes of an attachment.

    Args:
        sequence: The number of the sample within its publisher or client, from 1.
        source_time: The sender's time of sending, in nanoseconds since the Unix epoch.
        gid: The 16 bytes that identify the publisher or client.
    """
    return _pack(sequence, source_time, _GID_SIZE, gid)


def read_attachment(data: bytes | None) -> tuple[int, int, bytes]:
    """Return the sequence number, source time and GID of an attachment.

    Every sample received costs one call of this.

    Raises:
        DecodeError: The attachment is missing, damaged, or in the layout of an older release.
    """
    if data is None:
        raise DecodeError("attachment", -1, "missing; the sender is not a node of ROS 2 or rosz")
    if len(data) == _OLD_SIZE:
        raise DecodeError(
            "attachment", 0, "in the layout of rmw_zenoh before 0.2.5; update the sender"
        )
    if len(data) != _LAYOUT.size:
        raise DecodeError("attachment", 0, f"{len(data)} bytes, expected {_LAYOUT.size}")
    sequence, source_time, size, gid = _LAYOUT.unpack(data)
    if size != _GID_SIZE:
        raise DecodeError("attachment", 16, f"a GID of {size} bytes, expected {_GID_SIZE}")
    return sequence, source_time, gid
