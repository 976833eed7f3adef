"""What a replica does from time to time, unasked."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable
from typing import Final

from rosz.params.keys import Member
from rosz.params.replica.mirror import Mirror
from rosz.params.replica.sync import Synchroniser
from rosz.worker import start_thread

__all__ = ("Keeper",)

_TICK: Final = 1.0
_STOPPED: Final = 3.0
"""Seconds by which a tick must be late for the process to have been stopped, not just slow."""

_COMPARE_EVERY: Final = (10.0, 30.0)
_FORGET_EVERY: Final = 60.0
_RECONCILE_EVERY: Final = 30.0
_REMEMBERED_FOR: Final = 24 * 3600 * 1_000_000_000
_REMEMBERED: Final = 10_000


class Keeper:
    """Compares with another replica now and then, forgets old deletions, looks after storages.

    Args:
        own: This replica.
        sync: Compares it with others.
        mirror: Knows of storages.
        forgot: Called when deletions were forgotten.
    """

    def __init__(
        self, own: Member, sync: Synchroniser, mirror: Mirror, forgot: Callable[[], None]
    ) -> None:
        self._own = own
        self._sync = sync
        self._mirror = mirror
        self._forgot = forgot
        now = time.monotonic()
        self._last = now
        self._compare_at = now + random.uniform(*_COMPARE_EVERY)  # noqa: S311  # nothing secret
        self._forget_at = now + _FORGET_EVERY
        self._reconcile_at = now
        sync.worker.later(_TICK, self._tick)

    def _tick(self) -> None:
        self._sync.worker.later(_TICK, self._tick)
        now = time.monotonic()
        late = now - self._last - _TICK
        self._last = now
        self._sync.members.drop_ghosts()
        self._sync.state.read()
        if late > _STOPPED or now >= self._compare_at:
            self._compare_at = now + random.uniform(*_COMPARE_EVERY)  # noqa: S311  # nothing secret
            self._sync.compare_with_one()
        if now >= self._forget_at:
            self._forget_at = now + _FORGET_EVERY
            if self._sync.state.forget(_REMEMBERED_FOR, _REMEMBERED):
                self._forgot()
        self._look_after_storages(now)

    def _look_after_storages(self, now: float) -> None:
        if not self._mirror.wanted:
            self._reconcile_at = now
        elif now >= self._reconcile_at and self._oldest():
            self._reconcile_at = now + _RECONCILE_EVERY
            # It waits for answers, which the worker must not.
            target = self._mirror.reconcile
            start_thread(threading.Thread(target=target, name="rosz-params-mirror", daemon=True))

    def _oldest(self) -> bool:
        return all(self._own < other for other in self._sync.members.all())
