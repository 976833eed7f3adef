"""Timers: a callback at each period, on a thread of its own."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Self

import msgspec

from rosz.errors import ClosedError, TimeMovedBackwards, UsageError
from rosz.node.clock import Clock
from rosz.node.rate import Pace
from rosz.session import clamp_timeout

if TYPE_CHECKING:
    from types import TracebackType

__all__ = ("Timer", "TimerEvent")


class TimerEvent(msgspec.Struct, frozen=True):
    """When a timer was due and when it came; the fields of ROS 1, in nanoseconds.

    Attributes:
        last_expected: When the previous call was due; None at the first.
        last_real: When it was made; None at the first.
        current_expected: When this call was due.
        current_real: When it was made.
        last_duration: How long the previous call took, in wall time; None at the first.
    """

    last_expected: int | None
    last_real: int | None
    current_expected: int
    current_real: int
    last_duration: int | None


class Timer:
    """Call a function at each period until closed, or once.

    Calls never overlap. Like a `Rate`, the timer makes up for a late call, and gives up what it
    missed when more than two periods late. In simulated time it starts with the first ``/clock``.

    Args:
        period_ns: Nanoseconds between calls, and before the first.
        callback: What to call with a `TimerEvent`.
        clock: Whose time to go by; the timer ends when it is closed.
        on_error: Told, with a text, of what the callback raises; the timer goes on.
        oneshot: Whether to call once only.
        reset: What to do when ROS time moves back: call now and count on from there, or, as in
            ROS 1, tell `on_error` and stop.
        name: What to call the timer in such texts and in the list of threads.
        on_end: Called with the timer, on its thread, when it has ended.

    Raises:
        UsageError: The period is not above 0.
    """

    def __init__(
        self,
        period_ns: int,
        callback: Callable[[TimerEvent], object],
        clock: Clock,
        *,
        on_error: Callable[[str, BaseException], None],
        oneshot: bool = False,
        reset: bool = False,
        name: str = "",
        on_end: Callable[[Timer], None] | None = None,
    ) -> None:
        if period_ns <= 0:
            raise UsageError(f"timer period is '{period_ns}' ns: expected above 0")
        self.period_ns = period_ns
        self.name = name or getattr(callback, "__qualname__", repr(callback))
        self._callback = callback
        self._clock = clock.branch()
        self._on_error = on_error
        self._oneshot = oneshot
        self._reset = reset
        self._on_end = on_end
        self._thread = threading.Thread(
            target=self._run, name=f"rosz-timer {self.name}", daemon=True
        )
        self._thread.start()

    @property
    def alive(self) -> bool:
        """Whether the timer has calls to make, or is making its last."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Make no more calls; from anywhere, its own callback too, and again is no error.

        A call under way is not waited for: see `join`.
        """
        self._clock.close()

    shutdown = close

    def join(self, timeout: float | None = None) -> bool:
        """Wait until the timer has ended.

        Args:
            timeout: Seconds; forever when not given.

        Returns:
            Whether it has; False at once in its own callback.

        Raises:
            UsageError: The timeout is no number.
        """
        if threading.current_thread() is self._thread:
            return False
        self._thread.join(None if timeout is None else clamp_timeout(timeout))
        return not self._thread.is_alive()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        state = "" if self.alive else " ended"
        return f"<Timer {self.name} every {self.period_ns / 1e9:g} s{state}>"

    def _run(self) -> None:
        try:
            self._loop()
        finally:
            if self._on_end is not None:
                self._on_end(self)

    def _loop(self) -> None:
        clock = self._clock
        if not clock.wait_started():
            return
        pace = Pace(self.period_ns, clock.steady())
        expected = clock.now() + self.period_ns
        last_expected: int | None = None
        last_real: int | None = None
        last_duration: int | None = None
        while True:
            now = clock.steady()
            try:
                if not clock.sleep(pace.remaining(now)):
                    return
                pace.step(now)
            except TimeMovedBackwards as error:
                if not self._reset:
                    self._on_error(f"timer '{self.name}' stopped", error)
                    return
                pace.restart(clock.steady())
                expected = clock.now()
            real = clock.now()
            began = time.monotonic_ns()
            self._call(TimerEvent(last_expected, last_real, expected, real, last_duration))
            if self._oneshot:
                return
            last_duration = time.monotonic_ns() - began
            last_expected, last_real = expected, real
            expected += self.period_ns

    def _call(self, event: TimerEvent) -> None:
        try:
            self._callback(event)
        except BaseException as error:  # noqa: BLE001  # the timer outlives what it raises
            # What a callback tries on a node that is just shutting down is no fault of its.
            if not (isinstance(error, ClosedError) and self._clock.closed):
                self._on_error(f"callback of timer '{self.name}' failed", error)
