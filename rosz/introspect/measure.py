"""Rate, bandwidth and delay of a topic: ``rostopic hz``, ``bw`` and ``delay``.

One thread adds messages to a meter while another one reads its statistics.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from math import sqrt
from struct import Struct

import msgspec

from rosz.errors import DecodeError

_LONGEST_WINDOW = 50_000
_BANDWIDTH_WINDOW = 100
_SECOND = 1_000_000_000
_FEWEST_SIZES = 2
_KILO, _MEGA = 1e3, 1e6
_COLUMNS = ("topic", "rate", "min_delta", "max_delta", "std_dev", "window")
_STAMPS = {b"\0\1": Struct("<4xiI").unpack_from, b"\0\0": Struct(">4xiI").unpack_from}
_STAMP_SIZE = 12


class RateStats(msgspec.Struct, frozen=True):
    """The rate of a topic; times are in seconds.

    Attributes:
        rate: Messages per second.
        min_delta: Shortest time between two messages.
        max_delta: Longest time between two messages.
        std_dev: Standard deviation of these times.
        window: Number of messages measured.
    """

    rate: float
    min_delta: float
    max_delta: float
    std_dev: float
    window: int


class DelayStats(msgspec.Struct, frozen=True):
    """The age of messages when they arrive; times are in seconds.

    Attributes:
        mean: Mean age.
        min_delay: Lowest age; negative where the sender's clock is ahead.
        max_delay: Highest age.
        std_dev: Standard deviation.
        window: Number of messages measured.
    """

    mean: float
    min_delay: float
    max_delay: float
    std_dev: float
    window: int


class BandwidthStats(msgspec.Struct, frozen=True):
    """The bandwidth of a topic; sizes are in bytes.

    Attributes:
        bytes_per_second: Bandwidth from the oldest message of the window until now.
        mean: Mean size of a message.
        min_size: Size of the smallest message.
        max_size: Size of the largest message.
        window: Number of messages measured.
    """

    bytes_per_second: float
    mean: float
    min_size: int
    max_size: int
    window: int


class _TimeMeter:
    """The newest times of a series, in nanoseconds."""

    def __init__(self, window: int | None = None) -> None:
        size = _LONGEST_WINDOW if window is None else window
        self._times: deque[int] = deque(maxlen=max(size - 1, 0))
        self._last = -1
        self._reported = -1

    @property
    def begun(self) -> bool:
        """Whether anything has been measured."""
        return bool(self._times)

    def _add(self, value: int, now: int) -> None:
        """Add a value, or start again where there is no earlier time than now."""
        last, self._last = self._last, now
        if 0 <= last <= now:
            self._times.append(value)
        else:
            self._times.clear()

    def _summary(self) -> tuple[float, float, float, float, int] | None:
        """Return mean, minimum, maximum, deviation and count, if anything is new."""
        last = self._last
        times = self._times.copy()
        if not times or last == self._reported:
            return None
        self._reported = last
        count = len(times)
        mean = sum(times) / count
        deviation = sqrt(sum((time - mean) ** 2 for time in times) / count)
        low, high = min(times), max(times)
        return mean / _SECOND, low / _SECOND, high / _SECOND, deviation / _SECOND, count + 1


class RateMeter(_TimeMeter):
    """Measures how often messages arrive.

    Args:
        window: Number of newest messages to measure; 50 000 when not given.
    """

    def tick(self, now: int) -> None:
        """Count a message.

        Args:
            now: Time in nanoseconds, of any clock; when it goes back, counting starts again.
        """
        self._add(now - self._last, now)

    def stats(self) -> RateStats | None:
        """Return the rate; None if no message has arrived since the last call."""
        summary = self._summary()
        if summary is None:
            return None
        return RateStats(1 / summary[0] if summary[0] > 0 else 0.0, *summary[1:])


class DelayMeter(_TimeMeter):
    """Measures how old messages are when they arrive, by the stamp in their header.

    Args:
        window: Number of newest messages to measure; 50 000 when not given.
    """

    def add(self, stamp: int, now: int) -> None:
        """Count a message.

        Args:
            stamp: Time in the header, in nanoseconds.
            now: ROS time in nanoseconds; when it goes back, counting starts again.
        """
        self._add(now - stamp, now)

    def stats(self) -> DelayStats | None:
        """Return the delay; None if no message has arrived since the last call."""
        summary = self._summary()
        return None if summary is None else DelayStats(*summary)


class BandwidthMeter:
    """Measures how many bytes arrive per second.

    Args:
        window: Number of newest messages to measure. When not given, 100, or all of the last
            second where those are more, so that high rates are measured as well as low ones.
    """

    def __init__(self, window: int | None = None) -> None:
        self._window = _BANDWIDTH_WINDOW if window is None else max(window, 1)
        self._span = _SECOND if window is None else 0
        self._messages: deque[tuple[int, int]] = deque()

    def add(self, size: int, now: int) -> None:
        """Count a message.

        Args:
            size: Size of the message in bytes.
            now: Time in nanoseconds, of a clock that never goes back.
        """
        messages = self._messages
        messages.append((now, size))
        while len(messages) > self._window and now - messages[0][0] >= self._span:
            messages.popleft()

    def stats(self, now: int) -> BandwidthStats | None:
        """Return the bandwidth; None before the second message."""
        messages = self._messages.copy()
        if len(messages) < _FEWEST_SIZES:
            return None
        sizes = [size for _, size in messages]
        total = sum(sizes)
        seconds = max(now - messages[0][0], 1) / _SECOND
        return BandwidthStats(
            total / seconds, total / len(sizes), min(sizes), max(sizes), len(sizes)
        )


def read_stamp(payload: bytes, type_name: str) -> int:
    """Return the stamp of an encoded message that begins with a header, in nanoseconds.

    Args:
        payload: The encoded message; only its beginning is read.
        type_name: Name of its type, for errors.

    Raises:
        DecodeError: The payload is too short, or not CDR.
    """
    unpack = _STAMPS.get(payload[:2])
    if unpack is None or len(payload) < _STAMP_SIZE:
        raise DecodeError(type_name, 0, f"expected a header, got {payload[:_STAMP_SIZE].hex(' ')}")
    seconds, nanoseconds = unpack(payload)
    return int(seconds) * _SECOND + int(nanoseconds)


def format_rate(stats: RateStats | None) -> str:
    """Return the text of ``rostopic hz`` for one topic."""
    return _format_times("rate", stats)


def format_rates(rates: Mapping[str, RateStats | None]) -> str:
    """Return the table that ``rostopic hz`` prints about several topics."""
    rows = [
        (name, *(f"{value:.4}" for value in msgspec.structs.astuple(s)[:-1]), str(s.window))
        for name, s in rates.items()
        if s is not None
    ]
    return rate_table(rows) if rows else "no new messages"


def rate_table(rows: Sequence[tuple[str, ...]]) -> str:
    """Return a table of topics, and of the texts of their rates."""
    widths = [max(map(len, column)) for column in zip(_COLUMNS, *rows, strict=True)]
    head = "   ".join(map(str.center, _COLUMNS, widths))
    body = ["   ".join(map(str.ljust, row, widths)) for row in rows]
    return "\n".join([head, "=" * len(head), *body, ""])


def format_delay(stats: DelayStats | None) -> str:
    """Return the text of ``rostopic delay``."""
    return _format_times("delay", stats)


def _format_times(what: str, stats: RateStats | DelayStats | None) -> str:
    if stats is None:
        return "no new messages"
    mean, low, high, deviation, window = msgspec.structs.astuple(stats)
    return (
        f"average {what}: {mean:.3f}\n\tmin: {low:.3f}s"
        f" max: {high:.3f}s std dev: {deviation:.5f}s window: {window}"
    )


def format_bandwidth(stats: BandwidthStats) -> str:
    """Return the text of ``rostopic bw``: all numbers in the unit that suits the first."""
    scale, unit = 1.0, "B"
    if stats.bytes_per_second >= _MEGA:
        scale, unit = _MEGA, "MB"
    elif stats.bytes_per_second >= _KILO:
        scale, unit = _KILO, "KB"
    per_second, mean, low, high = (
        f"{value / scale:.2f}{unit}"
        for value in (stats.bytes_per_second, stats.mean, stats.min_size, stats.max_size)
    )
    return f"average: {per_second}/s\n\tmean: {mean} min: {low} max: {high} window: {stats.window}"
