"""rclpy.time, rclpy.duration and rclpy.clock: times, durations, clocks and rates."""

from __future__ import annotations

import time
from enum import IntEnum
from functools import total_ordering
from typing import Any, Self, overload

from rosz.errors import ClosedError
from rosz.msgs.builtin_interfaces.msg import Duration as DurationMessage
from rosz.msgs.builtin_interfaces.msg import Time as TimeMessage
from rosz.node import Clock as _RosClock
from rosz.node import Rate as _Rate
from rosz.qos import FOREVER
from rosz.ros2.rclpy.exceptions import ROSInterruptException

__all__ = (
    "CONVERSION_CONSTANT",
    "Clock",
    "ClockType",
    "Duration",
    "Infinite",
    "ROSClock",
    "Rate",
    "Time",
)

CONVERSION_CONSTANT = 1_000_000_000


@total_ordering
class Duration:
    """A span of time, which may be negative.

    Args:
        seconds: Seconds, with a fraction.
        nanoseconds: Nanoseconds, added to the seconds.
    """

    def __init__(self, *, seconds: float = 0, nanoseconds: int = 0) -> None:
        self._nanoseconds = int(seconds * CONVERSION_CONSTANT) + int(nanoseconds)

    @property
    def nanoseconds(self) -> int:
        """Length in nanoseconds."""
        return self._nanoseconds

    def to_msg(self) -> DurationMessage:
        """Return the duration as a message."""
        message: DurationMessage = DurationMessage.from_nsec(self._nanoseconds)
        return message

    @classmethod
    def from_msg(cls, msg: Any) -> Self:
        """Return the duration of a message."""
        return cls(seconds=msg.sec, nanoseconds=msg.nanosec)

    def __repr__(self) -> str:
        return f"Duration(nanoseconds={self._nanoseconds})"

    def __str__(self) -> str:
        return f"{self._nanoseconds} nanoseconds"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Duration) and self._nanoseconds == other.nanoseconds

    def __hash__(self) -> int:
        return hash(self._nanoseconds)

    def __lt__(self, other: Duration) -> bool:
        return self._nanoseconds < other.nanoseconds


Infinite = Duration(nanoseconds=FOREVER)


class ClockType(IntEnum):
    """The source of a time."""

    UNINITIALIZED = 0
    ROS_TIME = 1
    SYSTEM_TIME = 2
    STEADY_TIME = 3


@total_ordering
class Time:
    """A point in time.

    Args:
        seconds: Seconds, with a fraction.
        nanoseconds: Nanoseconds, added to the seconds.
        clock_type: Kind of the clock that the time belongs to.

    Raises:
        ValueError: The time is negative.
    """

    def __init__(
        self,
        *,
        seconds: float = 0,
        nanoseconds: int = 0,
        clock_type: ClockType = ClockType.SYSTEM_TIME,
    ) -> None:
        if seconds < 0 or nanoseconds < 0:
            raise ValueError(f"a time cannot be negative, got {seconds} s and {nanoseconds} ns")
        self._nanoseconds = int(seconds * CONVERSION_CONSTANT) + int(nanoseconds)
        self.clock_type: ClockType = clock_type

    @property
    def nanoseconds(self) -> int:
        """Nanoseconds since the start of the clock."""
        return self._nanoseconds

    def seconds_nanoseconds(self) -> tuple[int, int]:
        """Return the whole seconds and the remaining nanoseconds."""
        return divmod(self._nanoseconds, CONVERSION_CONSTANT)

    def to_msg(self) -> TimeMessage:
        """Return the time as a message."""
        return TimeMessage(*self.seconds_nanoseconds())

    @classmethod
    def from_msg(cls, msg: Any, clock_type: ClockType = ClockType.ROS_TIME) -> Self:
        """Return the time of a message."""
        return cls(seconds=msg.sec, nanoseconds=msg.nanosec, clock_type=clock_type)

    def __repr__(self) -> str:
        return f"Time(nanoseconds={self._nanoseconds}, clock_type={self.clock_type.name})"

    def __add__(self, other: object) -> Time:
        if not isinstance(other, Duration):
            return NotImplemented
        return self._shifted(other.nanoseconds)

    __radd__ = __add__

    @overload
    def __sub__(self, other: Time) -> Duration: ...
    @overload
    def __sub__(self, other: Duration) -> Time: ...
    def __sub__(self, other: object) -> Time | Duration:
        if isinstance(other, Time):
            return Duration(nanoseconds=self._nanoseconds - self._comparable(other))
        return self._shifted(-other.nanoseconds) if isinstance(other, Duration) else NotImplemented

    def _shifted(self, nanoseconds: int) -> Time:
        return Time(nanoseconds=self._nanoseconds + nanoseconds, clock_type=self.clock_type)

    def _comparable(self, other: Time) -> int:
        if other.clock_type != self.clock_type:
            raise TypeError(
                f"times of different clocks cannot be compared: {self.clock_type.name} and"
                f" {other.clock_type.name}; make both from one node's clock"
            )
        return other.nanoseconds

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Time) and self._nanoseconds == self._comparable(other)

    def __hash__(self) -> int:
        return hash(self._nanoseconds)

    def __lt__(self, other: Time) -> bool:
        return self._nanoseconds < self._comparable(other)


class Clock:
    """A clock of one kind.

    Args:
        clock_type: Kind of the clock.
        source: Source of ROS time; wall time when not given.
    """

    def __init__(
        self, *, clock_type: ClockType = ClockType.SYSTEM_TIME, source: _RosClock | None = None
    ) -> None:
        self.clock_type: ClockType = clock_type
        self._source = source or _RosClock()

    @property
    def ros_time_is_active(self) -> bool:
        """Whether the clock follows ``/clock``."""
        return self.clock_type is ClockType.ROS_TIME and self._source.simulated

    def now(self) -> Time:
        """Return the current time."""
        if self.clock_type is ClockType.STEADY_TIME:
            now = time.monotonic_ns()
        elif self.clock_type is ClockType.ROS_TIME:
            now = self._source.now()
        else:
            now = time.time_ns()
        return Time(nanoseconds=now, clock_type=self.clock_type)

    def sleep_for(self, rel_time: Duration) -> bool:
        """Sleep for a duration.

        Returns:
            False if the node was shut down before the end.
        """
        if self.clock_type is ClockType.ROS_TIME:
            return self._source.sleep(rel_time.nanoseconds)
        return _RosClock().sleep(rel_time.nanoseconds)

    def sleep_until(self, until: Time) -> bool:
        """Sleep until a time; see `sleep_for`."""
        return self.sleep_for(until - self.now())

    def __repr__(self) -> str:
        return f"Clock(clock_type={self.clock_type.name})"


class ROSClock(Clock):
    """A clock of ROS time: the time of ``/clock`` in a simulation, else wall time."""

    def __init__(self, source: _RosClock | None = None) -> None:
        super().__init__(clock_type=ClockType.ROS_TIME, source=source)


class Rate:
    """Run a loop at a fixed rate; made by ``Node.create_rate``."""

    def __init__(self, period_ns: int, source: _RosClock) -> None:
        self._rate = _Rate(1e9 / period_ns, source, reset=True)

    def sleep(self) -> None:
        """Sleep until the next period begins.

        Raises:
            ROSInterruptException: The node was shut down meanwhile.
        """
        try:
            self._rate.sleep()
        except ClosedError as error:
            raise ROSInterruptException from error

    def destroy(self) -> None:
        """Do nothing; a rate holds nothing that must be released."""
