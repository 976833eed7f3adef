"""Which of the messages of one line of a program to let through."""

from __future__ import annotations

import threading

__all__ = ("Site", "Throttle")

Site = tuple[str, int, int]
"""Where a call stands: file, line, and instruction, for two calls may share a line."""


class Throttle:
    """What was logged where, and when, to log it once or not too often.

    May be asked from any thread, and by a signal handler.
    """

    def __init__(self) -> None:
        # A signal handler may come in between on the thread that holds it.
        self._lock = threading.RLock()
        self._seen: set[Site] = set()
        self._times: dict[Site, int] = {}
        self._texts: dict[Site, str] = {}

    def first(self, site: Site) -> bool:
        """Tell whether this is the first time."""
        with self._lock:
            count = len(self._seen)
            self._seen.add(site)
            return len(self._seen) > count

    def elapsed(self, site: Site, now: int, period_ns: int) -> bool:
        """Tell whether the last time is more than a period ago, or later than now.

        Args:
            site: Where.
            now: Time in nanoseconds.
            period_ns: Nanoseconds.
        """
        with self._lock:
            last = self._times.get(site)
            if last is not None and last > now:
                self._times.clear()
            elif last is not None and now - last <= period_ns:
                return False
            self._times[site] = now
            return True

    def changed(self, site: Site, text: str) -> bool:
        """Tell whether the text is another than the last one there."""
        with self._lock:
            same = self._texts.get(site) == text
            self._texts[site] = text
            return not same
