"""rclpy.timer: callbacks at a rate."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rosz.node import Timer as RoszTimer
from rosz.node.clock import Clock as RoszClock
from rosz.ros2.rclpy.callback_groups import CallbackGroup
from rosz.ros2.rclpy.clock import Clock, Rate

__all__ = ("Rate", "Timer")


class Timer:
    """Has a function called every so often; made by ``Node.create_timer``.

    What it misses while nobody spins is left out: it is called once then, not many times.
    """

    def __init__(
        self,
        period_ns: int,
        callback: Callable[[], Any] | None,
        source: RoszClock,
        *,
        clock: Clock,
        group: CallbackGroup,
        wake: Callable[[], None],
        report: Callable[[str, BaseException], None],
        autostart: bool = True,
    ) -> None:
        self.callback = callback
        self.callback_group = group
        self.clock = clock
        self._source = source.branch()
        self._period = period_ns
        self._wake = wake
        self._report = report
        self._due = False
        self._last = self._source.steady()
        self._ticking: RoszTimer | None = None
        if autostart:
            self.reset()

    @property
    def timer_period_ns(self) -> int:
        """Nanoseconds from call to call."""
        return self._period

    @timer_period_ns.setter
    def timer_period_ns(self, value: int) -> None:
        self._period = int(value)
        if self._ticking is not None:
            self.reset()

    def reset(self) -> None:
        """Count the period from now; a timer that was cancelled goes on."""
        self.cancel()
        self._last = self._source.steady()
        self._ticking = RoszTimer(
            self._period, lambda _: self._tick(), self._source, on_error=self._report, reset=True
        )

    def cancel(self) -> None:
        """Make no more calls until `reset`."""
        self._due = False
        if self._ticking is not None:
            self._ticking.close()
            self._ticking = None

    def is_canceled(self) -> bool:
        """Tell whether it was cancelled."""
        return self._ticking is None

    def is_ready(self) -> bool:
        """Tell whether a call is due."""
        return self._due

    def time_since_last_call(self) -> int:
        """Return nanoseconds since the last call, or since the beginning."""
        return self._source.steady() - self._last

    def time_until_next_call(self) -> int | None:
        """Return nanoseconds until the next call is due; None when cancelled."""
        return None if self._ticking is None else self._period - self.time_since_last_call()

    def _tick(self) -> None:
        self._due = True
        self._wake()

    def take(self) -> Callable[[], Any] | None:
        """Return what to call, if it is due."""
        if not self._due:
            return None
        self._due = False
        self._last = self._source.steady()
        return self.callback

    def destroy(self) -> None:
        """End it."""
        self.cancel()
        self._source.close()
