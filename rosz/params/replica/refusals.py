"""Writes that another replica does not take, as by the rules beside its keys."""

from __future__ import annotations

import logging
import time
from typing import Final

from rosz.params.paths import Path, joined
from rosz.params.replica.state import State
from rosz.params.writes import Write

__all__ = ("Refusals",)

_log = logging.getLogger("rosz.params")

_RESTS: Final = 3600.0
"""Seconds before it is tried again: the rules on the way may be others by then."""


class Refusals:
    """What was told in vain, so that it is not told with every comparison; not safe for threads."""

    def __init__(self) -> None:
        self._tried: dict[tuple[str, Path, int, str], float] = {}
        self._news: dict[str, list[Path]] = {}

    def rests(self, zid: str, write: Write) -> bool:
        """Tell whether a replica was told a write in vain not long ago."""
        tried = self._tried.get(_key(zid, write))
        return tried is not None and time.monotonic() - tried < _RESTS

    def add(self, zid: str, write: Write) -> None:
        """Take note of a write that a replica did not take."""
        key = _key(zid, write)
        if key not in self._tried:
            self._news.setdefault(zid, []).append(write.path)
        self._tried[key] = time.monotonic()

    def report(self, zid: str, label: str) -> None:
        """Log what a replica refused for the first time.

        Args:
            zid: Its session.
            label: What people call it.
        """
        paths = self._news.pop(zid, [])
        if paths:
            more = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
            _log.warning(
                "%s does not take '%s'%s, which differs there from now on: the rules beside its"
                " keys may not allow it",
                label,
                joined(paths[0]),
                more,
            )

    def forget(self, zid: str) -> None:
        """Forget what a replica did not take."""
        self._news.pop(zid, None)
        for key in [key for key in self._tried if key[0] == zid]:
            del self._tried[key]

    def trim(self, state: State) -> None:
        """Forget all but what concerns writes that are still there."""
        for key in list(self._tried):
            _, path, time_, clock = key
            write = state.find(path)
            if write is None or (write.time, write.clock) != (time_, clock):
                del self._tried[key]


def _key(zid: str, write: Write) -> tuple[str, Path, int, str]:
    return zid, write.path, write.time, write.clock
