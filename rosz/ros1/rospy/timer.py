"""Sleeping, rates and timers in ROS time (ROS wiki, rospy/Overview/Time)."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rosz.errors import TimeMovedBackwards
from rosz.ros1.rospy.absent import attribute
from rosz.ros1.rospy.exceptions import (
    ROSInterruptException,
    ROSTimeMovedBackwardsException,
)
from rosz.ros1.rospy.rostime import (
    Duration,
    Time,
    clock,
    get_rostime,
    is_wallclock,
    wallsleep,
)
from rosz.ros1.rospy.state import cooperate, state
from rosz.ros1.rospy.state import is_shutdown as ended
from rosz.time import DurationValue, TimeValue

if TYPE_CHECKING:
    from rosz.time import DurationValue as AnyDuration

__all__ = ("Rate", "Timer", "TimerEvent", "sleep")

_SECOND = 1_000_000_000
_ENDED = "ROS shutdown request"
_SLEPT_OUT = 2.0
"""Seconds of a sleep that a shutdown leaves to be slept out.

Under Python 3, rospy sleeps every sleep in wall time to its end, and programs rely on it: what
follows their loop stops the robot. A longer rest is ended by the exception that rospy documents.
"""


def sleep(duration: float | AnyDuration) -> None:
    """Sleep in ROS time.

    Args:
        duration: Seconds, or a ``rospy.Duration``; nothing to sleep for if not above 0.

    Raises:
        ROSInterruptException: The node was shut down meanwhile, and more than two seconds were
            left to sleep, or time is simulated.
        ROSTimeMovedBackwardsException: ROS time was set back meanwhile.
        ROSInitException: Time is simulated, and ``init_node`` has not been called.
    """
    seconds = duration.to_sec() if isinstance(duration, DurationValue) else duration
    if seconds < 0:
        return
    in_hook = state.ender is threading.current_thread() and not state.ended.is_set()
    if state.node is None or in_hook:
        # As in rospy: hooks that stop a robot and wait for it may do so.
        wallsleep(seconds)
    elif ended():
        _sleep_out(seconds)
    else:
        _sleep_ns(round(seconds * _SECOND))


def _sleep_ns(nanoseconds: int) -> None:
    cooperate()
    began = time.monotonic_ns()
    try:
        slept = clock().sleep(nanoseconds)
    except TimeMovedBackwards as error:
        raise ROSTimeMovedBackwardsException((error.after - error.before) / _SECOND) from error
    if slept:
        return
    _sleep_out((nanoseconds - (time.monotonic_ns() - began)) / _SECOND)


def _sleep_out(seconds: float) -> None:
    """Sleep what is left of a sleep when the node is shut down."""
    if not is_wallclock() or seconds > _SLEPT_OUT:
        raise ROSInterruptException(_ENDED)
    wallsleep(seconds)


class Rate:
    """Hold a loop at a rate: call `sleep` at the end of each turn.

    Args:
        hz: Turns per second.
        reset: Whether to go on, with a new period, when ROS time is set back.

    Attributes:
        last_time: Time that the current period is counted from.
        sleep_dur: The period.

    Raises:
        ROSInitException: ``init_node`` has not been called.
        ZeroDivisionError: `hz` is 0.
    """

    def __init__(self, hz: float, reset: bool = False) -> None:
        self.last_time = get_rostime()
        build: Any = Duration
        self.sleep_dur: Duration = build(0, int(1e9 / hz))
        self._reset = reset

    def _remaining(self, curr_time: TimeValue) -> DurationValue:
        if self.last_time > curr_time:
            self.last_time = Time.from_nsec(curr_time.to_nsec())
        return self.sleep_dur - (curr_time - self.last_time)

    def remaining(self) -> DurationValue:
        """Return how long the next `sleep` would be; negative if it is late."""
        return self._remaining(get_rostime())

    def sleep(self) -> None:
        """Sleep until the next turn is due; not at all if it already is.

        Raises:
            ROSInterruptException: The node was shut down meanwhile.
            ROSTimeMovedBackwardsException: ROS time was set back, and `reset` is off.
        """
        now = get_rostime()
        try:
            sleep(self._remaining(now))
        except ROSTimeMovedBackwardsException:
            if not self._reset:
                raise
            self.last_time = get_rostime()
            return
        self.last_time += self.sleep_dur
        if now - self.last_time > self.sleep_dur * 2:
            self.last_time = now


class TimerEvent:
    """When a timer was due, and when it came.

    Attributes:
        last_expected: When the previous call was due; None at the first.
        last_real: When it was made; None at the first.
        current_expected: When this call was due.
        current_real: When it was made.
        last_duration: Seconds that the previous call took, in wall time; None at the first.
    """

    def __init__(
        self,
        last_expected: Time | None,
        last_real: Time | None,
        current_expected: Time,
        current_real: Time,
        last_duration: float | None,
    ) -> None:
        self.last_expected = last_expected
        self.last_real = last_real
        self.current_expected = current_expected
        self.current_real = current_real
        self.last_duration = last_duration


class Timer(threading.Thread):
    """Call a function at each period, on this thread, until `shutdown` or the node's end.

    What the function raises ends the timer, as in rospy, with a traceback.

    Args:
        period: A ``rospy.Duration``.
        callback: Gets a `TimerEvent`.
        oneshot: Whether to call it only once.
        reset: Whether to go on when ROS time is set back.
    """

    def __init__(
        self,
        period: DurationValue,
        callback: Callable[[TimerEvent], object],
        oneshot: bool = False,
        reset: bool = False,
    ) -> None:
        super().__init__(daemon=True)
        self._period = period
        self._callback = callback
        self._oneshot = oneshot
        self._reset = reset
        self._shutdown = False
        self.start()

    def shutdown(self) -> None:
        """Make no more calls; one under way is not waited for."""
        self._shutdown = True

    def run(self) -> None:
        """Do the work of the thread."""
        rate = Rate(1.0 / self._period.to_sec(), reset=self._reset)
        expected = rate.last_time + self._period
        last_expected: Time | None = None
        last_real: Time | None = None
        last_duration: float | None = None
        while not (ended() or self._shutdown):
            try:
                rate.sleep()
            except ROSTimeMovedBackwardsException:
                raise
            except ROSInterruptException:
                return
            if ended() or self._shutdown:
                return
            real = get_rostime()
            began = time.monotonic()
            self._callback(TimerEvent(last_expected, last_real, expected, real, last_duration))
            if self._oneshot:
                return
            last_duration = time.monotonic() - began
            last_expected, last_real = expected, real
            expected += self._period


__getattr__ = attribute(__name__)
