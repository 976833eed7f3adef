"""What a node closes at its end, whom it tells before, and that this happens but once."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from rosz.errors import ClosedError
from rosz.node.log import NodeLog

if TYPE_CHECKING:
    from rosz.lifecycle import Closable

__all__ = ("Ending", "Hook")

Hook = Callable[[str], None]
"""Called with the reason of the end."""

P = TypeVar("P", bound="Closable")
_ENDED_BY = 10.0
"""Seconds that whoever ends a node a second time waits for the first, and its hooks, to be done."""


class Ending:
    """The parts and hooks of a node. Safe for threads, and for any callback.

    Args:
        name: Full name of the node, for errors.
        log: Told of hooks and parts that raise.

    Attributes:
        begun: Set when the end has begun.
        lock: Held while parts come and go.
        parts: What is closed, in the order of its coming.
    """

    def __init__(self, name: str, log: NodeLog) -> None:
        self.begun = threading.Event()
        self.lock = threading.RLock()
        self.parts: list[Closable] = []
        self._name = name
        self._log = log
        self._hooks: list[Hook] = []
        self._reason = ""
        self._over = threading.Event()
        self._thread: threading.Thread | None = None

    def keep(self, part: P) -> P:
        """Have something closed at the end, before what came earlier.

        Raises:
            ClosedError: The end has begun; the part is closed, too, now.
        """
        with self.lock:
            if not self.begun.is_set():
                self.parts.append(part)
                return part
        part.close()
        raise ClosedError(f"node '{self._name}' is closed")

    def forget(self, part: Closable) -> None:
        """Take note that a part has been closed by itself."""
        with self.lock:
            if part in self.parts:
                self.parts.remove(part)

    def add_hook(self, hook: Hook) -> None:
        """Have a function called before the parts are closed; at once where the end has begun."""
        with self.lock:
            begun = self.begun.is_set()
            if not begun:
                self._hooks.append(hook)
        if begun:
            self._call(hook)

    def come(self, reason: str, first: Callable[[], object]) -> None:
        """End: hooks, then parts, the newest first.

        Whoever comes second waits for the first.

        Args:
            reason: For the hooks.
            first: Called before all else.
        """
        with self.lock:
            begun = self.begun.is_set()
            self.begun.set()
            if not begun:
                self._reason, self._thread = reason, threading.current_thread()
        if begun:
            # The main thread, often, on its way out: it must not outrun the first.
            if threading.current_thread() is not self._thread:
                self._over.wait(_ENDED_BY)
            return
        try:
            first()
            for hook in reversed(self._hooks):
                self._call(hook)
        finally:  # also where Ctrl-C interrupts a hook
            try:
                self._close_parts()
            finally:
                self._over.set()

    def _call(self, hook: Hook) -> None:
        try:
            hook(self._reason)
        except (Exception, SystemExit):  # noqa: BLE001  # the callback boundary
            self._log.exception("a shutdown hook failed")

    def _close_parts(self) -> None:
        self._log.flush()
        for part in self.parts[::-1]:  # each takes itself off the list
            try:
                part.close()
            except Exception:  # noqa: BLE001  # a part may be anybody's
                self._log.exception("a part of the node could not be closed")
        self._log.close()
