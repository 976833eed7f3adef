"""Packets of the rosserial protocol (ROS wiki, rosserial/Overview/Protocol), to and from bytes.

A packet is 0xff, the version of the protocol, the length of the payload (two bytes, the low one
first), the checksum of the length, the ID of the topic (likewise two bytes), the payload, and the
checksum of ID and payload. A checksum is 255 minus the sum of the bytes modulo 256.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

from rosz.errors import EncodeError

_SYNC = 0xFF
_VERSION = 0xFE
_VERSIONS = {0xFF: "rosserial 0.4 and earlier", 0xFD: "a later version of rosserial"}
_HEAD = 5
_OVERHEAD = 8
_MOST = 0xFFFF


class Packet(NamedTuple):
    """A message between the computer and the device.

    Attributes:
        topic: ID of the topic.
        payload: The message in ROS 1's layout.
    """

    topic: int
    payload: bytes


class Damage(NamedTuple):
    """Bytes that are not a packet.

    Attributes:
        reason: The fault.
    """

    reason: str


def _checksum(data: bytes | bytearray) -> int:
    return 255 - sum(data) % 256


def pack(packet: Packet) -> bytes:
    """Return the bytes of a packet.

    Raises:
        EncodeError: The payload is longer than a packet can be.
    """
    size = len(packet.payload)
    if size > _MOST:
        reason = f"it has {size} bytes; a rosserial packet has at most {_MOST}"
        raise EncodeError(f"packet of topic {packet.topic}", "", reason)
    length = struct.pack("<H", size)
    body = struct.pack("<H", packet.topic) + packet.payload
    return bytes([_SYNC, _VERSION, *length, _checksum(length), *body, _checksum(body)])


class PacketReader:
    """Reads packets, some of them damaged, from bytes that arrive in pieces.

    After damage, the search for the next packet begins at the byte behind the one that looked like
    a beginning, so that a packet is not lost inside of bytes that were taken for another one.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._reported: set[str] = set()

    def feed(self, data: bytes) -> Iterator[Packet | Damage]:
        """Take bytes, and yield the packets in them; each kind of damage once until a packet.

        Args:
            data: Bytes that have arrived.
        """
        self._buffer += data
        while (result := self._next()) is not None:
            if isinstance(result, Packet):
                self._reported.clear()
                yield result
            elif result not in self._reported:
                self._reported.add(result)
                yield Damage(result)

    def expire(self) -> Iterator[Packet | Damage]:
        """Give up a packet that has begun, since its rest does not come."""
        if self._buffer:
            del self._buffer[0]
            yield Damage("the rest of a packet did not arrive")
            yield from self.feed(b"")

    def _next(self) -> Packet | str | None:
        """Return the next packet, or the damage of the next bytes; None to wait for more."""
        buffer = self._buffer
        start = buffer.find(_SYNC)
        if start:
            skipped = len(buffer) if start < 0 else start
            del buffer[:skipped]
            return "skipped bytes that are not a packet" if skipped else None
        if len(buffer) > 1 and buffer[1] != _VERSION:
            return self._skip(_other_version(buffer[1]))
        if len(buffer) < _HEAD:
            return None
        if buffer[4] != _checksum(buffer[2:4]):
            return self._skip("wrong checksum of a packet's length")
        return self._complete(int.from_bytes(buffer[2:4], "little"))

    def _complete(self, size: int) -> Packet | str | None:
        """Return the packet with a payload of a size, if all of it is there."""
        buffer = self._buffer
        if len(buffer) < size + _OVERHEAD:
            return None
        body = bytes(buffer[_HEAD : size + _OVERHEAD - 1])
        if buffer[size + _OVERHEAD - 1] != _checksum(body):
            return self._skip("wrong checksum of a packet")
        del buffer[: size + _OVERHEAD]
        return Packet(int.from_bytes(body[:2], "little"), body[2:])

    def _skip(self, reason: str) -> str:
        del self._buffer[0]
        return reason


def _other_version(version: int) -> str:
    program = _VERSIONS.get(version)
    return (
        f"protocol version 0x{version:02x}{f' ({program})' if program else ''}, expected"
        f" 0x{_VERSION:02x} (rosserial 0.5 and later): sync is lost, or the device has another"
        " version"
    )
