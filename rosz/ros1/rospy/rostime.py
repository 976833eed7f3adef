"""Times, durations and the clock by rospy's names (ROS wiki, rospy/Overview/Time)."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Self

from rosz.msgs.builtin_interfaces.msg import Duration as DurationMessage
from rosz.msgs.builtin_interfaces.msg import Time as TimeMessage
from rosz.ros1.rospy.absent import attribute
from rosz.ros1.rospy.exceptions import ROSInitException
from rosz.ros1.rospy.state import state
from rosz.time import ClassicConstructor

if TYPE_CHECKING:
    from rosz.node.clock import Clock

__all__ = (
    "Duration",
    "Time",
    "get_rostime",
    "get_time",
    "is_rostime_initialized",
    "is_wallclock",
    "set_rostime_initialized",
    "switch_to_wallclock",
    "wallsleep",
)


class Duration(DurationMessage, metaclass=ClassicConstructor):
    """A span of time: ``Duration(1.5)``, ``Duration(1, 500000000)``."""

    def __repr__(self) -> str:
        return f"rospy.Duration[{self.to_nsec()}]"


class Time(TimeMessage, metaclass=ClassicConstructor):
    """A point in time: ``Time(1.5)``, ``Time(1, 500000000)``, ``Time.now()``."""

    def __repr__(self) -> str:
        return f"rospy.Time[{self.to_nsec()}]"

    @classmethod
    def now(cls) -> Time:
        """Return the ROS time.

        Raises:
            ROSInitException: ``init_node`` has not been called.
        """
        return get_rostime()

    @classmethod
    def from_seconds(cls, float_secs: float) -> Self:
        """Return the time of so many seconds since the epoch; the older name of ``from_sec``."""
        return cls.from_sec(float_secs)


def clock() -> Clock:
    """Return the clock of the node.

    Raises:
        ROSInitException: ``init_node`` has not been called.
    """
    if state.node is None:
        raise ROSInitException("time is not initialized. Have you called init_node()?")
    return state.node.clock


def get_rostime() -> Time:
    """Return the ROS time: wall time, or that of ``/clock`` in simulation.

    Raises:
        ROSInitException: ``init_node`` has not been called.
    """
    build: Any = Time
    now: Time = build(0, clock().now())
    return now


def get_time() -> float:
    """Return the ROS time as float seconds.

    Raises:
        ROSInitException: ``init_node`` has not been called.
    """
    return get_rostime().to_sec()


def is_rostime_initialized() -> bool:
    """Tell whether there is a time."""
    return state.node is not None


def set_rostime_initialized(val: bool) -> None:
    """Do nothing: there is a time as soon as there is a node."""


def is_wallclock() -> bool:
    """Tell whether time is that of the machine rather than of a simulation."""
    return state.node is None or not state.node.clock.simulated


def switch_to_wallclock() -> None:
    """Do nothing: which time a node lives in is settled by /use_sim_time when it starts."""


def wallsleep(duration: float) -> None:
    """Sleep so many seconds of wall time; not at all if that is negative."""
    if duration > 0:
        time.sleep(duration)


__getattr__ = attribute(__name__)
