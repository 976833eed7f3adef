"""The saves of the writes of a replica, and the waiters for their results."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from typing import Final

from rosz.params.history import History
from rosz.params.paths import Path
from rosz.params.replica.core.effects import Acknowledge, Compact, Save
from rosz.params.replica.core.events import Saved
from rosz.params.replica.core.work import Work
from rosz.params.writes import Write

RETRY: Final = "save again"
_RETRY_AFTER: Final = 1.0

Waiter = Acknowledge | int
"""An acknowledgement, or the number of an own batch, that waits for a save."""


class Disk:
    """The file of a replica, if it has one.

    Args:
        work: Gives the time of the step, and collects its effects.

    Attributes:
        reason: Why writes cannot be stored; empty if they can.
    """

    def __init__(self, work: Work) -> None:
        self.reason: str = ""
        self._work = work
        self._pending: dict[int, list[Write]] = {}
        self._waiting: list[tuple[int, Waiter]] = []
        # The disk may stay full for long, so only the newest write of each path is kept.
        self._unsaved: dict[Path, Write] = {}
        # The newest save that repeats what could not be saved: until then, not all is stored.
        self._repeats = 0
        self._compactions: set[int] = set()
        self._must_compact = False
        self._retrying = False

    @property
    def is_current(self) -> bool:
        """Whether there is a file, and all is in it, or on the way there."""
        return self._work.config.stored and not self.reason

    def save(self, writes: list[Write]) -> None:
        """Save new writes, and those that could not be saved before."""
        if self._work.config.stored and (writes or self._unsaved):
            number = self._work.number()
            if self._unsaved:
                self._repeats = number
            writes = [*self._unsaved.values(), *writes]
            self._unsaved = {}
            self._pending[number] = writes
            self._work.do(Save(number, writes))

    def compact(self, history: History) -> None:
        """Replace the whole content of the file."""
        if self._work.config.stored:
            self._must_compact = False
            self._unsaved = {}
            number = self._repeats = self._work.number()
            writes = self._pending[number] = list(history.writes())
            self._compactions.add(number)
            self._work.do(Compact(number, writes, history.horizon))

    def wait(self, waiter: Waiter) -> str | None:
        """Return why the writes so far cannot be stored; empty if they are stored.

        If that is not known yet, the waiter is returned by `on_saved` later, and this is ``None``.
        """
        if not self._pending:
            return self.reason
        self._waiting.append((max(self._pending), waiter))
        return None

    def on_saved(self, event: Saved) -> list[tuple[Waiter, str]]:
        """Handle the end of saves; return those that waited for it, and why it failed."""
        done = [number for number in self._pending if number <= event.number]
        for number in done:
            writes = self._pending.pop(number)
            if event.reason:
                self._keep(writes)
                self._must_compact = self._must_compact or number in self._compactions
            self._compactions.discard(number)
        are_missing = bool(self._unsaved) or self._repeats in self._pending
        if event.reason or not are_missing:
            self._report(event.reason)
        if event.reason or self._must_compact:
            self._retry_later()
        if not event.reason and self._repeats in self._pending:
            return []
        ready = [waiter for number, waiter in self._waiting if number <= event.number]
        self._waiting = [entry for entry in self._waiting if entry[0] > event.number]
        return [(waiter, self.reason) for waiter in ready]

    def on_retry(self, history: History) -> None:
        """Try again to save, or to compact, unless a save is under way."""
        self._retrying = False
        if self._pending:
            self._retry_later()
        elif self._must_compact:
            self.compact(history)
        elif self._unsaved:
            self.save([])

    def _retry_later(self) -> None:
        if not self._retrying:
            self._retrying = True
            self._work.later(_RETRY_AFTER, RETRY)

    def _keep(self, writes: Iterable[Write]) -> None:
        for write in writes:
            known = self._unsaved.get(write.path)
            if known is None or known.order < write.order:
                self._unsaved[write.path] = write

    def _report(self, reason: str) -> None:
        if reason and not self.reason:
            self._work.log(
                logging.ERROR, f"parameters cannot be saved, and each set says so: {reason}"
            )
        elif self.reason and not reason:
            self._work.log(logging.WARNING, "parameters are saved again")
        self.reason = reason
