"""rclpy.clock: clocks that tell the time and sleep by it."""

from __future__ import annotations

import time

from rosz.errors import ClosedError
from rosz.node.clock import Clock as _RosClock
from rosz.ros2.rclpy.duration import Duration
from rosz.ros2.rclpy.time import ClockType, Time

__all__ = ("Clock", "ClockType", "ROSClock")


class Clock:
    """A clock of one kind.

    Args:
        clock_type: What it counts.
        source: Where ROS time comes from; wall time when not given.
    """

    def __init__(
        self, *, clock_type: ClockType = ClockType.SYSTEM_TIME, source: _RosClock | None = None
    ) -> None:
        self.clock_type = clock_type
        self._source = source or _RosClock()

    @property
    def ros_time_is_active(self) -> bool:
        """Whether it follows ``/clock``."""
        return self.clock_type is ClockType.ROS_TIME and self._source.simulated

    def now(self) -> Time:
        """Return the time."""
        if self.clock_type is ClockType.STEADY_TIME:
            now = time.monotonic_ns()
        elif self.clock_type is ClockType.ROS_TIME:
            now = self._source.now()
        else:
            now = time.time_ns()
        return Time(nanoseconds=now, clock_type=self.clock_type)

    def sleep_for(self, rel_time: Duration) -> bool:
        """Sleep for a while.

        Returns:
            Whether it was slept through; false when the node was shut down meanwhile.
        """
        if self.clock_type is ClockType.ROS_TIME:
            return self._source.sleep(rel_time.nanoseconds)
        return _RosClock().sleep(rel_time.nanoseconds)

    def sleep_until(self, until: Time) -> bool:
        """Sleep until a time comes; see `sleep_for`."""
        return self.sleep_for(until - self.now())

    def __repr__(self) -> str:
        return f"Clock(clock_type={self.clock_type.name})"


class ROSClock(Clock):
    """A clock of ROS time: that of ``/clock`` in a simulation, else wall time."""

    def __init__(self, source: _RosClock | None = None) -> None:
        super().__init__(clock_type=ClockType.ROS_TIME, source=source)


class Rate:
    """Hold a loop at a rate.

    Args:
        period_ns: Nanoseconds from turn to turn.
        source: Whose time to go by.
    """

    def __init__(self, period_ns: int, source: _RosClock) -> None:
        from rosz.node import Rate as _Rate

        self._rate = _Rate(1e9 / period_ns, source, reset=True)

    def sleep(self) -> None:
        """Sleep until the next turn is due.

        Raises:
            ROSInterruptException: The node was shut down meanwhile.
        """
        from rosz.ros2.rclpy.exceptions import ROSInterruptException

        try:
            self._rate.sleep()
        except ClosedError as error:
            raise ROSInterruptException from error

    def destroy(self) -> None:
        """Do nothing: there is nothing to give back."""
