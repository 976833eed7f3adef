"""The attachment that every publication, request and reply carries (rmw_zenoh).

Sequence number and source time as little-endian 64-bit integers, then the GID behind its length.
"""

from __future__ import annotations

from struct import Struct

import msgspec

from rosz.errors import DecodeError

__all__ = ("Attachment", "pack", "read", "unpack")

GID_SIZE = 16
_LAYOUT = Struct("<qqB16s")
_OLD_SIZE = 77
_pack = _LAYOUT.pack


class Attachment(msgspec.Struct, frozen=True):
    """Where a sample comes from.

    Attributes:
        sequence: Number of the sample within its publisher or client, from 1.
        source_time: Nanoseconds since the Unix epoch, by the sender's system clock.
        gid: The 16 bytes that identify the publisher or client.
    """

    sequence: int
    source_time: int
    gid: bytes


def pack(sequence: int, source_time: int, gid: bytes) -> bytes:
    """Return the 33 bytes of an attachment."""
    return _pack(sequence, source_time, GID_SIZE, gid)


def unpack(data: bytes | None) -> Attachment:
    """Read an attachment.

    Raises:
        DecodeError: It is missing, of an older release's layout, or damaged.
    """
    if data is None:
        raise DecodeError("attachment", -1, "missing; the sender is no ROS 2 or rosz node")
    return Attachment(*read(data))


def read(data: bytes) -> tuple[int, int, bytes]:
    """Read an attachment's sequence number, source time and GID, which every sample costs.

    Raises:
        DecodeError: It is of an older release's layout, or damaged.
    """
    if len(data) != _LAYOUT.size:
        if len(data) == _OLD_SIZE:
            raise DecodeError(
                "attachment", 0, "in the layout of rmw_zenoh before 0.2.5; update the sender"
            )
        raise DecodeError("attachment", 0, f"{len(data)} bytes, expected {_LAYOUT.size}")
    sequence, source_time, size, gid = _LAYOUT.unpack(data)
    if size != GID_SIZE:
        raise DecodeError("attachment", 16, f"a GID of {size} bytes, expected {GID_SIZE}")
    return sequence, source_time, gid
