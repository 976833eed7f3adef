"""A simulated clock that shows when a thread begins to sleep, so that tests need not guess."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from network import TIMEOUT

from rosz.errors import RoszError
from rosz.node.clock import Clock

SECOND = 1_000_000_000
START = 100 * SECOND


class Beds(set[Any]):
    """The set of those asleep, which counts them in."""

    def __init__(self) -> None:
        super().__init__()
        self.taken = threading.Semaphore(0)

    def add(self, element: Any, /) -> None:
        super().add(element)
        self.taken.release()


class SimulatedClock(Clock):
    """A clock at `START` seconds, or at none yet."""

    def __init__(self, start: int = START) -> None:
        super().__init__()
        self.beds = Beds()
        self._source.sleepers = self.beds
        self.enable_simulation()
        if start:
            self.advance(start)

    def wait_for_sleeper(self) -> None:
        """Wait until one more sleep has begun."""
        assert self.beds.taken.acquire(timeout=TIMEOUT), "nobody fell asleep"

    def tick(self, time_ns: int) -> None:
        """Advance to a time once one more sleep has begun."""
        self.wait_for_sleeper()
        self.advance(time_ns)

    def asleep(self, function: Callable[[], object]) -> Task:
        """Call a function on a thread, and wait until it sleeps."""
        task = Task(function)
        self.wait_for_sleeper()
        return task


class Task:
    """A call on a thread of its own, and its result."""

    def __init__(self, function: Callable[[], object]) -> None:
        self._function = function
        self._result: object = None
        self._error: RoszError | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            self._result = self._function()
        except RoszError as error:
            self._error = error

    @property
    def done(self) -> bool:
        return not self._thread.is_alive()

    def result(self) -> object:
        """Wait for the call, and return its result or raise its error."""
        self._thread.join(TIMEOUT)
        assert self.done, "the call has not returned"
        if self._error is not None:
            raise self._error
        return self._result
