"""Keeping what a replica takes in on disk, and telling when it is safe there."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Protocol

from rosz.errors import RoszError
from rosz.params.replica.worker import Worker
from rosz.params.writes import Write

__all__ = ("Keep", "Saver")

_log = logging.getLogger("rosz.params")


class Keep(Protocol):
    """Something that writes outlive the process in."""

    def load(self) -> list[Write]:
        """Return what was saved."""

    def save(self, writes: list[Write]) -> None:
        """Keep writes; when it returns they survive a power cut."""

    def replace(self, writes: list[Write]) -> None:
        """Keep these writes and nothing else."""

    def close(self) -> None:
        """Let go of the file."""


class Saver:
    """Saves what is news on a thread of its own, many writes at a time.

    Args:
        keep: Where to.
    """

    def __init__(self, keep: Keep) -> None:
        self._keep = keep
        self._worker = Worker("rosz-params-save")
        self._unsaved: list[Write] = []
        self._waiting: list[Callable[[], None]] = []

    def load(self) -> list[Write]:
        """Return what was saved."""
        return self._keep.load()

    def take(self, news: list[Write]) -> None:
        """Save writes soon."""
        self._worker.submit(lambda: self._add(news, None))

    def when_safe(self, then: Callable[[], None]) -> None:
        """Call a function, on the saver's thread, when all that was taken before is saved."""
        self._worker.submit(lambda: self._add([], then))

    def trim(self, snapshot: Callable[[], list[Write]]) -> None:
        """Soon keep only what the snapshot then holds."""
        self._worker.submit(lambda: self._replace(snapshot))

    def close(self) -> None:
        """Save what is left and let go of the file; again is no error."""
        self._worker.submit(self._flush)
        self._worker.close()
        self._keep.close()

    def _add(self, news: list[Write], then: Callable[[], None] | None) -> None:
        self._unsaved += news
        if then is not None:
            self._waiting.append(then)
        if not self._worker.pending:  # else whatever is next does it
            self._flush()

    def _replace(self, snapshot: Callable[[], list[Write]]) -> None:
        # Whatever is taken in meanwhile is in the snapshot, or is saved after it.
        try:
            self._keep.replace(snapshot())
        except RoszError as error:
            _log.error("parameters are not saved: %s", error)  # the text says it all
        self._flush()

    def _flush(self) -> None:
        writes, self._unsaved = self._unsaved, []
        waiting, self._waiting = self._waiting, []
        try:
            if writes:
                self._keep.save(writes)
        except RoszError as error:
            _log.error("parameters are not saved: %s", error)  # the text says it all
            # The disk may be full for long, and only the newest write at each path is to be kept.
            self._unsaved = list({write.path: write for write in writes}.values())
            return
        for then in waiting:
            then()
