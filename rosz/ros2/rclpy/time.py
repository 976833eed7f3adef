"""rclpy.time: points in time, each of one kind of clock."""

from __future__ import annotations

from enum import IntEnum
from typing import Any, Self, overload

from rosz.msgs.builtin_interfaces.msg import Time as TimeMessage
from rosz.ros2.rclpy.duration import Duration

__all__ = ("CONVERSION_CONSTANT", "ClockType", "Time")

CONVERSION_CONSTANT = 1_000_000_000


class ClockType(IntEnum):
    """Where a time comes from."""

    UNINITIALIZED = 0
    ROS_TIME = 1
    SYSTEM_TIME = 2
    STEADY_TIME = 3


class Time:
    """A point in time.

    Args:
        seconds: Seconds, of which fractions count.
        nanoseconds: Nanoseconds beside them.
        clock_type: What they are counted by.

    Raises:
        ValueError: It is negative.
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
        self.clock_type = clock_type

    @property
    def nanoseconds(self) -> int:
        """Nanoseconds since the beginning."""
        return self._nanoseconds

    def seconds_nanoseconds(self) -> tuple[int, int]:
        """Return whole seconds, and nanoseconds beyond them."""
        return divmod(self._nanoseconds, CONVERSION_CONSTANT)

    def to_msg(self) -> TimeMessage:
        """Return it as a message."""
        return TimeMessage(*self.seconds_nanoseconds())

    @classmethod
    def from_msg(cls, msg: Any, clock_type: ClockType = ClockType.ROS_TIME) -> Self:
        """Return what a message says."""
        return cls(seconds=msg.sec, nanoseconds=msg.nanosec, clock_type=clock_type)

    def __repr__(self) -> str:
        return f"Time(nanoseconds={self._nanoseconds}, clock_type={self.clock_type.name})"

    def __add__(self, other: object) -> Time:
        if not isinstance(other, Duration):
            return NotImplemented
        return self._moved(other.nanoseconds)

    __radd__ = __add__

    @overload
    def __sub__(self, other: Time) -> Duration: ...
    @overload
    def __sub__(self, other: Duration) -> Time: ...
    def __sub__(self, other: object) -> Time | Duration:
        if isinstance(other, Time):
            return Duration(nanoseconds=self._nanoseconds - self._comparable(other))
        return self._moved(-other.nanoseconds) if isinstance(other, Duration) else NotImplemented

    def _moved(self, nanoseconds: int) -> Time:
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

    def __le__(self, other: Time) -> bool:
        return self._nanoseconds <= self._comparable(other)

    def __gt__(self, other: Time) -> bool:
        return self._nanoseconds > self._comparable(other)

    def __ge__(self, other: Time) -> bool:
        return self._nanoseconds >= self._comparable(other)
