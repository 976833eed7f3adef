"""Fingerprints of a set of writes: equal sets have equal ones, whatever the order they came in.

A digest is `BUCKETS` numbers. Each write falls into the bucket of its path and is folded into its
number by exclusive or, so adding and removing cost the same. Two replicas whose digests differ
talk about the buckets that do, and about nothing else.
"""

from __future__ import annotations

import struct
import zlib
from _blake2 import blake2b  # hashlib's, without OpenSSL, which every node would load
from typing import Final

from rosz.errors import DecodeError
from rosz.params.paths import Path
from rosz.params.writes import Write

__all__ = ("BUCKETS", "Digest", "bucket_of", "mark_of")

BUCKETS: Final = 64
_LAYOUT: Final = struct.Struct(f"<{BUCKETS}Q")


def bucket_of(path: Path) -> int:
    """Return the bucket of a path."""
    return zlib.crc32("/".join(path).encode()) % BUCKETS


def mark_of(write: Write) -> int:
    """Return what a write adds to its bucket: 64 bits of its path and stamp."""
    text = f"{write.time} {write.clock} {'/'.join(write.path)}"
    return int.from_bytes(blake2b(text.encode(), digest_size=8).digest(), "little")


class Digest:
    """The fingerprint of a set of writes."""

    __slots__ = ("_marks",)

    def __init__(self) -> None:
        self._marks = [0] * BUCKETS

    def toggle(self, path: Path, mark: int) -> None:
        """Add a write, or remove it if it is in."""
        self._marks[bucket_of(path)] ^= mark

    def to_bytes(self) -> bytes:
        """Return it in the form that others compare."""
        return _LAYOUT.pack(*self._marks)

    def differing(self, other: bytes) -> list[int]:
        """Return the buckets in which another replica's set is not ours.

        Raises:
            DecodeError: The bytes are no digest.
        """
        if len(other) != _LAYOUT.size:
            raise DecodeError("digest", 0, f"{len(other)} bytes, expected {_LAYOUT.size}")
        theirs = _LAYOUT.unpack(other)
        return [index for index, mark in enumerate(self._marks) if mark != theirs[index]]
