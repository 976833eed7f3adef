"""How ``rosz core`` starts itself afresh when its links are of no more use, or its keys change."""

from __future__ import annotations

import os
import threading
import time
from typing import TYPE_CHECKING

import msgspec

from rosz.params.wire import Keys
from rosz.session import (
    Router,
    SplitWatch,
    SuspensionDetector,
    on_loss,
    restart_program,
    take_handover,
)
from rosz.wire import processes_key, tokens_key

if TYPE_CHECKING:
    from rosz.params.replica import Replica
    from rosz.security import KeyWatch

_LOOK_SECONDS = 1.0
_CALM_SECONDS = 600.0
"""Time without a split after which patience, which doubles with each split, begins anew."""


class Handover(msgspec.Struct):
    """The state that a core hands over to the process that replaces it.

    Attributes:
        why: Reason of the restart; empty if it is the first start.
        parameters: All writes of its replica; see `Replica.frozen`.
        splits: Number of restarts because of a split, in a row.
    """

    why: str = ""
    parameters: bytes = b""
    splits: int = 0

    @classmethod
    def take(cls) -> Handover:
        """Return what was handed over to this process."""
        content = take_handover()
        return cls() if content is None else msgspec.msgpack.decode(content, type=cls)


class CoreWatch:
    """Finds out when a core has to start afresh."""

    def __init__(
        self,
        router: Router,
        replica: Replica,
        domain: int,
        before: Handover,
        *,
        key_watch: KeyWatch | None = None,
    ) -> None:
        self._replica = replica
        self._router = router
        self._key_watch = key_watch
        self._splits = before.splits
        self._suspension = SuspensionDetector(router.outlasted_silence)
        self._began = time.monotonic()
        self._found = threading.Event()
        self._why = ""
        on_loss(self._restart)
        self._split_watch: SplitWatch | None = None
        if not router.has_rules:
            keys = Keys(domain, scoped=router.session.secured)
            tokens = (tokens_key(domain), processes_key(domain), keys.tokens)
            self._split_watch = SplitWatch(
                router.session, domain, tokens, self._on_split, self._splits
            )

    def restart_when_needed(self, owner: int = 0) -> None:
        """Start the program afresh as soon as its links are of no more use, or its keys change.

        Args:
            owner: Process that started this one and ends with it; this returns when that has ended.

        Raises:
            OSError: The program cannot be executed any more.
        """
        while not self._found.wait(_LOOK_SECONDS):
            if owner and os.getppid() != owner:
                return
            self._router.check_room()
            if seconds := self._suspension.seconds():
                self._why = f"stood still for {seconds:.0f} s, longer than others keep its links"
                break
            if self._key_watch is not None and (change := self._key_watch.change()):
                self._why = change
                break
        with self._replica.frozen() as parameters:
            handover = Handover(self._why, parameters, self._splits)
            restart_program(msgspec.msgpack.encode(handover))

    def close(self) -> None:
        """Stop watching; a second call has no effect."""
        if self._split_watch is not None:
            self._split_watch.close()

    def _on_split(self, why: str) -> None:
        calm = time.monotonic() - self._began > _CALM_SECONDS
        self._splits = 1 if calm else self._splits + 1
        self._restart(why)

    def _restart(self, why: str) -> None:
        self._why = why
        self._found.set()
