"""rclpy.time, rclpy.duration and rclpy.clock: times, durations, clocks and rates."""

from __future__ import annotations

import time
from collections.abc import Callable
from enum import IntEnum
from functools import total_ordering
from typing import Any, NamedTuple, Self, overload

from rosz.errors import ClosedError
from rosz.lifecycle import Closing, Registration
from rosz.msgs.builtin_interfaces.msg import Duration as DurationMessage
from rosz.msgs.builtin_interfaces.msg import Time as TimeMessage
from rosz.node import Clock as _RosClock
from rosz.node import Rate as _Rate
from rosz.node import TimeJump as _TimeJump
from rosz.qos import FOREVER as _FOREVER
from rosz.ros2.rclpy.exceptions import ROSInterruptException

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


Infinite = Duration(nanoseconds=_FOREVER)


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


class ClockChange(IntEnum):
    """Whether a jump of time begins or ends a simulation."""

    ROS_TIME_NO_CHANGE = 1
    ROS_TIME_ACTIVATED = 2
    ROS_TIME_DEACTIVATED = 3
    SYSTEM_TIME_NO_CHANGE = 4


class JumpThreshold:
    """The jumps of time for which a callback is called.

    Args:
        min_forward: Smallest jump forward; none when not given.
        min_backward: Smallest jump back, a negative duration; none when not given.
        on_clock_change: Whether the beginning and the end of a simulation count, too.

    Raises:
        ValueError: A duration has the wrong sign.
    """

    def __init__(
        self,
        *,
        min_forward: Duration | None,
        min_backward: Duration | None,
        on_clock_change: bool = True,
    ) -> None:
        if min_forward is not None and min_forward.nanoseconds <= 0:
            raise ValueError("min_forward must be a positive non-zero duration")
        if min_backward is not None and min_backward.nanoseconds >= 0:
            raise ValueError("min_backward must be a negative non-zero duration")
        self.min_forward: Duration | None = min_forward
        self.min_backward: Duration | None = min_backward
        self.on_clock_change: bool = on_clock_change

    def rosz_counts(self, jump: _TimeJump) -> bool:
        """Return whether a step of time is such a jump."""
        forward, back = self.min_forward, self.min_backward
        return (
            (self.on_clock_change and jump.switched)
            or (forward is not None and jump.delta >= forward.nanoseconds)
            or (back is not None and jump.delta <= back.nanoseconds)
        )


class TimeJump(NamedTuple):
    """A jump of time: whether a simulation begins or ends, and by how much time moves."""

    clock_change: ClockChange
    delta: Duration


class JumpHandle(Registration, Closing):
    """Calls callbacks for jumps of time until ``unregister``; made by a clock."""

    unregister = Registration.close


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

    def create_jump_callback(
        self,
        threshold: JumpThreshold,
        *,
        pre_callback: Callable[[], object] | None = None,
        post_callback: Callable[[TimeJump], object] | None = None,
    ) -> JumpHandle:
        """Call functions when ROS time jumps; the time of other clocks does not.

        Args:
            threshold: The jumps that the functions are called for.
            pre_callback: Function called before the time is set.
            post_callback: Function called after that, with the jump.

        Raises:
            ValueError: Neither callback is given.
        """
        if pre_callback is None and post_callback is None:
            raise ValueError("One of pre_callback or post_callback must be callable")

        def after(jump: _TimeJump) -> None:
            active = self._source.simulated
            change = ClockChange.ROS_TIME_ACTIVATED if active else ClockChange.ROS_TIME_DEACTIVATED
            if not jump.switched:
                change = ClockChange.ROS_TIME_NO_CHANGE
            if post_callback is not None:
                post_callback(TimeJump(change, Duration(nanoseconds=jump.delta)))

        source = self._source if self.clock_type is ClockType.ROS_TIME else _RosClock()
        return JumpHandle(source.on_jump(after, wanted=threshold.rosz_counts, before=pre_callback))

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
