"""The attachment that every publication, request and reply carries (rmw_zenoh).

It consists of the sequence number and the source time as little-endian 64-bit integers, and of the
GID after its length.
"""

from __future__ import annotations

from struct import Struct

from rosz.errors import DecodeError

_GID_SIZE = 16
_LAYOUT = Struct("<qqB16s")
_OLD_SIZE = 77
_pack = _LAYOUT.pack


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
