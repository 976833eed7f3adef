"""Samples that arrive on a session, and the time stamps that order writes.

`Sample` is a thin view of Zenoh's object, which decodes an attribute when it is read.

Stamps come from a hybrid logical clock. Zenoh's own timestamps come from one as well, but a router
may replace a timestamp that lies in its future, and Zenoh cannot rebuild one from its number. So
rosz keeps the clock itself, in whole nanoseconds, which Zenoh's 64-bit NTP times carry without
loss. A stamp that has to arrive unchanged is also written into the payload or the attachment.
"""

from __future__ import annotations

import threading
import time
from typing import Any

import msgspec
import zenoh

_SECOND = 1_000_000_000


class Stamp(msgspec.Struct, frozen=True, order=True):
    """A unique time stamp of a write; ordered by time, then by clock.

    Attributes:
        time: Nanoseconds since the Unix epoch, moved forward where the order requires it.
        id: The clock that it was taken from: a session id in lower-case hex.
    """

    time: int
    id: str


class HybridClock:
    """A clock whose stamps grow, and are later than every stamp that it has observed.

    Args:
        clock_id: The name of this clock: the session id.
    """

    def __init__(self, clock_id: str) -> None:
        self._id = clock_id
        self._last = 0
        self._lock = threading.Lock()

    def now(self) -> Stamp:
        """Return a new stamp."""
        with self._lock:
            self._last = max(self._last + 1, time.time_ns())
            return Stamp(self._last, self._id)

    def observe(self, stamp: Stamp) -> None:
        """Make all further stamps later than this one."""
        with self._lock:
            self._last = max(self._last, stamp.time)


def stamp_of(timestamp: zenoh.Timestamp | None) -> Stamp | None:
    """Return a Zenoh timestamp as a stamp."""
    if timestamp is None:
        return None
    raw = int(str(timestamp.get_time_as_ntp64()))
    seconds, fraction = raw >> 32, raw & 0xFFFFFFFF
    nanoseconds = (fraction * _SECOND + (1 << 31)) >> 32
    return Stamp(seconds * _SECOND + nanoseconds, str(timestamp.get_id()))


def to_timestamp(stamp: Stamp | None) -> zenoh.Timestamp | None:
    """Return a stamp as a Zenoh timestamp."""
    if stamp is None:
        return None
    seconds, nanoseconds = divmod(stamp.time, _SECOND)
    digits = stamp.id if len(stamp.id) % 2 == 0 else "0" + stamp.id
    # Zenoh prints an id as one number, but takes it as little-endian bytes.
    return zenoh.Timestamp(zenoh.NTP64(seconds, nanoseconds), bytes.fromhex(digits)[::-1])


class RawItem:
    """An object of Zenoh that arrived."""

    __slots__ = ("_raw",)

    def __init__(self, raw: Any) -> None:
        self._raw = raw

    @property
    def key(self) -> str:
        """The key expression that was written or queried."""
        return str(self._raw.key_expr)

    @property
    def attachment(self) -> bytes | None:
        """The bytes sent beside the payload."""
        raw = self._raw.attachment
        return None if raw is None else raw.to_bytes()


class Sample(RawItem):
    """One put or delete that arrived."""

    __slots__ = ()
    _raw: zenoh.Sample

    @property
    def raw(self) -> Any:
        """Zenoh's own object, for this package alone."""
        return self._raw

    @property
    def payload(self) -> bytes:
        """The bytes that were written."""
        return self._raw.payload.to_bytes()

    @property
    def size(self) -> int:
        """The size of the payload in bytes; reading it does not copy the payload."""
        return len(self._raw.payload)

    @property
    def stamp(self) -> Stamp | None:
        """The time of the write, by the clock of the network."""
        return stamp_of(self._raw.timestamp)

    @property
    def deleted(self) -> bool:
        """Whether it is a delete."""
        return self._raw.kind == zenoh.SampleKind.DELETE
