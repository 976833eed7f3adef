"""rospy.timer: sleeping, rates and timers in ROS time (ROS wiki, rospy/Overview/Time)."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from rosz.errors import TimeMovedBackwards
from rosz.ros1.client.rospy import rostime
from rosz.ros1.exceptions import ROSInterruptException, ROSTimeMovedBackwardsException
from rosz.ros1.state import clock, is_shutdown, state
from rosz.time import DurationValue, TimeValue

__all__ = ("Rate", "Timer", "TimerEvent", "sleep")

_SECOND = 1_000_000_000
_SHUT_DOWN = "ROS shutdown request"
_FINISHED = 2.0
"""Longest rest of a sleep, in seconds, that a shutdown does not interrupt.

Under Python 3, rospy finishes every sleep in wall time, and programs rely on it: the code after
their loop stops the robot. A longer rest ends with the exception that rospy documents.
"""


def sleep(duration: float | DurationValue) -> None:
    """Sleep in ROS time.

    Args:
        duration: Seconds, or a ``rospy.Duration``; a negative one does not sleep.

    Raises:
        ROSInterruptException: The node was shut down with more than two seconds left to sleep, or
            in simulated time.
        ROSTimeMovedBackwardsException: ROS time was set back.
        ROSInitException: Time is simulated, and ``init_node`` has not been called.
    """
    seconds = duration.to_sec() if isinstance(duration, DurationValue) else duration
    if seconds < 0:
        return
    in_hook = state.hook_thread is threading.current_thread() and not state.lifecycle.closed
    if in_hook or (state.node is None and rostime.is_wallclock()):
        # As in rospy, a hook may stop a robot and wait for it.
        rostime.wallsleep(seconds)
    elif is_shutdown():
        _finish_sleep(seconds)
    else:
        began = time.monotonic()
        try:
            slept = clock().sleep(round(seconds * _SECOND))
        except TimeMovedBackwards as error:
            raise ROSTimeMovedBackwardsException((error.after - error.before) / _SECOND) from error
        if not slept:
            _finish_sleep(seconds - (time.monotonic() - began))


def _finish_sleep(seconds: float) -> None:
    """Sleep the rest of a sleep that the shutdown interrupts."""
    if not rostime.is_wallclock() or seconds > _FINISHED:
        raise ROSInterruptException(_SHUT_DOWN)
    rostime.wallsleep(seconds)


class Rate:
    """Runs a loop at a rate: call `sleep` at the end of each pass.

    Args:
        hz: Passes per second.
        reset: Whether to start a new period, instead of an error, when ROS time is set back.

    Attributes:
        last_time: Start of the current period.
        sleep_dur: Length of the period.

    Raises:
        ROSInitException: ``init_node`` has not been called.
        ZeroDivisionError: `hz` is 0.
    """

    def __init__(self, hz: float, reset: bool = False) -> None:
        self.last_time = rostime.get_rostime()
        build: Any = rostime.Duration
        self.sleep_dur: rostime.Duration = build(0, int(1e9 / hz))
        self._reset = reset

    def _remaining(self, curr_time: TimeValue) -> DurationValue:
        if self.last_time > curr_time:
            self.last_time = rostime.Time.from_nsec(curr_time.to_nsec())
        return self.sleep_dur - (curr_time - self.last_time)

    def remaining(self) -> DurationValue:
        """Return the duration of the next `sleep`; negative if it is late."""
        return self._remaining(rostime.get_rostime())

    def sleep(self) -> None:
        """Sleep until the end of the period; not at all if it is over.

        Raises:
            ROSInterruptException: The node was shut down.
            ROSTimeMovedBackwardsException: ROS time was set back, and `reset` is false.
        """
        now = rostime.get_rostime()
        try:
            sleep(self._remaining(now))
        except ROSTimeMovedBackwardsException:
            if not self._reset:
                raise
            self.last_time = rostime.get_rostime()
            return
        self.last_time += self.sleep_dur
        if now - self.last_time > self.sleep_dur * 2:
            self.last_time = now


class TimerEvent:
    """The expected and real times of a timer's calls.

    Attributes:
        last_expected: Expected time of the previous call; None for the first call.
        last_real: Real time of the previous call; None for the first call.
        current_expected: Expected time of this call.
        current_real: Real time of this call.
        last_duration: Wall time of the previous call in seconds; None for the first call.
    """

    def __init__(
        self,
        last_expected: rostime.Time | None,
        last_real: rostime.Time | None,
        current_expected: rostime.Time,
        current_real: rostime.Time,
        last_duration: float | None,
    ) -> None:
        self.last_expected = last_expected
        self.last_real = last_real
        self.current_expected = current_expected
        self.current_real = current_real
        self.last_duration = last_duration


class Timer(threading.Thread):
    """A thread that calls a function periodically until `shutdown` or the node's shutdown.

    As in rospy, an exception of the function ends the timer with a traceback.

    Args:
        period: Period as a ``rospy.Duration``.
        callback: Function of a `TimerEvent`.
        oneshot: Whether to call it only once.
        reset: Whether to continue when ROS time is set back.
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
        """Stop the calls; do not wait for a running one."""
        self._shutdown = True

    def run(self) -> None:
        """Run the timer; called by the thread."""
        rate = Rate(1.0 / self._period.to_sec(), reset=self._reset)
        expected = rate.last_time + self._period
        last_expected: rostime.Time | None = None
        last_real: rostime.Time | None = None
        last_duration: float | None = None
        while not (is_shutdown() or self._shutdown):
            try:
                rate.sleep()
            except ROSTimeMovedBackwardsException:
                raise
            except ROSInterruptException:
                return
            if is_shutdown() or self._shutdown:
                return
            real = rostime.get_rostime()
            began = time.monotonic()
            self._callback(TimerEvent(last_expected, last_real, expected, real, last_duration))
            if self._oneshot:
                return
            last_duration = time.monotonic() - began
            last_expected, last_real = expected, real
            expected += self._period
