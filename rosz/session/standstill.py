"""Noticing that this process stood still for longer than others keep its links.

A process stands still while it is stopped (SIGSTOP, Ctrl-Z) or while its machine sleeps. Others
give up its links then, and routers of eclipse-zenoh 1.10.2 that link to each other again do not
recover from that: see `tests/upstream/stopped_router.py`.
"""

from __future__ import annotations

import time

__all__ = ("Standstill",)

_CLOCK = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
"""The clock that counts the time in which the machine sleeps, where there is one."""


class Standstill:
    """Tells, from the pauses between its calls, whether this process stood still.

    Args:
        longest: The pause in seconds that links outlast.
    """

    def __init__(self, longest: float) -> None:
        self.longest = longest
        self._last = time.clock_gettime(_CLOCK)

    def seconds(self) -> float:
        """Return the length of the pause before this call; 0 if links outlast it."""
        now = time.clock_gettime(_CLOCK)
        passed, self._last = now - self._last, now
        return passed if passed > self.longest else 0.0
