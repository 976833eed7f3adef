"""Calls that tell ROS 1's nodes what has changed, in order for each, and the newest of a kind."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any

from rosz.bridges.ros1.peers import call
from rosz.bridges.ros1.shared import Shared
from rosz.bridges.ros1.sockets import log
from rosz.errors import RoszError, TransportError

__all__ = ("Notifier",)

_RETRY = 1.0

_Args = Callable[[str], tuple[Any, ...]]
"""Function that makes the arguments of a call of the address of this machine."""


class Notifier:
    """Calls nodes, one call at a time for each. Safe for threads.

    A node that hangs holds up nobody else, and misses nothing: what it has not taken is sent again.

    Args:
        shared: What the bridge shares.
        is_known: Function that tells whether a URI is still that of a node.
    """

    def __init__(self, shared: Shared, is_known: Callable[[str], bool]) -> None:
        self._shared = shared
        self._is_known = is_known
        self._lock = threading.Lock()
        self._pending: dict[str, dict[tuple[str, str], _Args]] = {}
        self._running: set[str] = set()

    def post(self, uri: str, method: str, subject: str, args: _Args) -> None:
        """Call a method of a node, soon.

        Args:
            uri: URI of the node.
            method: Name of the method.
            subject: Name of what the call is about; a call that waits for the same method and
                subject is replaced.
            args: Function that makes the arguments, when the call is made.
        """
        with self._lock:
            self._pending.setdefault(uri, {})[method, subject] = args
            if uri in self._running:
                return
            self._running.add(uri)
        self._shared.requests.submit(partial(self._run, uri))

    def _run(self, uri: str) -> None:
        """Make the calls of a node that wait."""
        while True:
            with self._lock:
                pending = self._pending.get(uri)
                if not pending:
                    self._pending.pop(uri, None)
                    self._running.discard(uri)
                    return
                method, subject = next(iter(pending))
                args = pending.pop((method, subject))
            try:
                call(uri, method, args)
            except TransportError as error:
                with self._lock:
                    self._pending.setdefault(uri, {}).setdefault((method, subject), args)
                log.debug("%s", error)
                self._shared.changes.later(_RETRY, partial(self._resume, uri))
                return
            except RoszError as error:
                log.debug("node at %s: %s", uri, error)

    def _resume(self, uri: str) -> None:
        if self._is_known(uri):
            self._shared.requests.submit(partial(self._run, uri))
            return
        with self._lock:
            self._pending.pop(uri, None)
            self._running.discard(uri)
