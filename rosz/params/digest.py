"""Fingerprints of a set of writes: equal sets have equal ones, whatever the order they came in.

A digest is `BUCKETS` numbers. Each write falls into the bucket of its path and is folded into its
number by exclusive or, so adding and removing cost the same. Two replicas whose digests differ
talk about the buckets that do, and about nothing else.
"""

from __future__ import annotations

import struct
import zlib
from typing import Final

from rosz.errors import DecodeError
from rosz.params.paths import Path
from rosz.params.writes import Write

try:
    # hashlib's own, without OpenSSL, which every node would load for it.
    from _blake2 import blake2b
except ImportError:
    from hashlib import blake2b

__all__ = ("BUCKETS", "Digest", "bucket_of")

BUCKETS: Final = 64
_MOST_NOTED: Final = 1000
_LAYOUT: Final = struct.Struct(f"<{BUCKETS}Q")


def bucket_of(path: Path) -> int:
    """Return the bucket of a path."""
    return zlib.crc32("/".join(path).encode()) % BUCKETS


class Digest:
    """The fingerprint of a set of writes.

    Writes come and go far more often than anybody asks, so they are only noted, and folded in when
    somebody does or many are noted.
    """

    __slots__ = ("_marks", "_noted")

    def __init__(self) -> None:
        self._marks = [0] * BUCKETS
        self._noted: list[tuple[Path, int, str]] = []

    def toggle(self, write: Write) -> None:
        """Add a write, or remove it if it is in."""
        self._noted.append((write.path, write.time, write.clock))
        if len(self._noted) >= _MOST_NOTED:
            self._fold()

    def to_bytes(self) -> bytes:
        """Return it in the form that others compare."""
        self._fold()
        return _LAYOUT.pack(*self._marks)

    def differing(self, other: bytes) -> list[int]:
        """Return the buckets in which another replica's set is not ours.

        Raises:
            DecodeError: The bytes are no digest.
        """
        if len(other) != _LAYOUT.size:
            raise DecodeError("digest", 0, f"{len(other)} bytes, expected {_LAYOUT.size}")
        self._fold()
        theirs = _LAYOUT.unpack(other)
        return [index for index, mark in enumerate(self._marks) if mark != theirs[index]]

    def _fold(self) -> None:
        noted, self._noted = self._noted, []
        for path, time, clock in noted:
            text = "/".join(path)
            mark = blake2b(f"{time} {clock} {text}".encode(), digest_size=8).digest()
            self._marks[zlib.crc32(text.encode()) % BUCKETS] ^= int.from_bytes(mark, "little")
