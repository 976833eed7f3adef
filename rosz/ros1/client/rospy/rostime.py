"""rospy.rostime: times, durations and the clock (ROS wiki, rospy/Overview/Time)."""

from __future__ import annotations

import time
from typing import Any, Self

from rosz.msgs.builtin_interfaces.msg import Duration as DurationMessage
from rosz.msgs.builtin_interfaces.msg import Time as TimeMessage
from rosz.node import Clock
from rosz.ros1.state import clock, has_node, state
from rosz.time import ClassicConstructor, TimeValue


class Duration(DurationMessage, metaclass=ClassicConstructor):
    """A duration: ``Duration(1.5)``, ``Duration(1, 500000000)``."""

    def __repr__(self) -> str:
        return f"rospy.Duration[{self.to_nsec()}]"


class Time(TimeMessage, metaclass=ClassicConstructor):
    """A point in time: ``Time(1.5)``, ``Time(1, 500000000)``, ``Time.now()``."""

    def __repr__(self) -> str:
        return f"rospy.Time[{self.to_nsec()}]"

    @classmethod
    def now(cls) -> Time:
        """Return the ROS time; see `get_rostime`."""
        return get_rostime()

    @classmethod
    def from_seconds(cls, float_secs: float) -> Self:
        """Return the time of seconds since the epoch; the older name of ``from_sec``."""
        return cls.from_sec(float_secs)


def get_rostime() -> Time:
    """Return the ROS time: wall time, or the time of ``/clock`` in simulation.

    Raises:
        ROSInitException: ``init_node`` has not been called.
    """
    build: Any = Time
    now: Time = build(0, clock().now())
    return now


def get_time() -> float:
    """Return the ROS time in seconds; see `get_rostime`."""
    return get_rostime().to_sec()


def is_rostime_initialized() -> bool:
    """Return whether the time can be read."""
    return has_node() or state.clock is not None


def set_rostime_initialized(val: bool) -> None:
    """Let the time be read before ``init_node``, as wall time; tests do so."""
    state.clock = Clock() if val else None


def is_wallclock() -> bool:
    """Return whether ROS time is wall time, not that of a simulation."""
    return not is_rostime_initialized() or not clock().simulated


def switch_to_wallclock() -> None:
    """Take wall time again before ``init_node``; ``/use_sim_time`` selects the clock of a node."""
    if state.clock is not None:
        set_rostime_initialized(True)


def _set_rostime(t: TimeValue) -> None:
    """Set the ROS time, as tests of programs do; raise a ValueError if it is none."""
    if not isinstance(t, TimeValue):
        raise ValueError(f"must be Time instance: {type(t)}")  # noqa: TRY004  # rospy's
    if not is_rostime_initialized():
        set_rostime_initialized(True)
    clock().enable_simulation()
    clock().advance(t.to_nsec())


def wallsleep(duration: float) -> None:
    """Sleep for seconds of wall time; not at all if the duration is negative."""
    if duration > 0:
        time.sleep(duration)
