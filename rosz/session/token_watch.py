"""Reports of a watch of tokens, and of the end of those that existed at its beginning."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress

import zenoh

from rosz.errors import ClosedError, TransportError
from rosz.session.declared import Declared
from rosz.session.queries import Replies

_UNSETTLED_SECONDS = 10.0
"""Seconds from its beginning in which a watch may be told of the end of a token first."""
_LOOKS = 6
"""Queries that must all miss a token before it counts as ended."""
LOOK_SECONDS = 0.02
"""Seconds between them. On a busy machine one query in 30 missed a token if each followed the last
at once, up to five in a row; with this pause one in 500, and never two in a row."""


class TokenWatch:
    """Reports tokens, on the thread of its watch.

    Seen with eclipse-zenoh 1.10.2, and not reported upstream yet: a watch that begins while tokens
    disappear may be told of the end of some of these first, and then that they exist
    (`tests/interop/test_hostile.py`). Of a query on a busy machine some replies come after its end:
    the query misses their tokens, and the session tells all later watches that one of these exists,
    for ever (`tests/upstream/late_reply.py`). Only for such tokens further queries decide.

    Args:
        callback: Function called with the key of a token, and with whether it appeared (true) or
            disappeared (false).
        own: The tokens of the session by their keys.
        live: Function that returns the keys of the tokens that are alive, by a query.

    Attributes:
        complete: Function called once the tokens that existed at the beginning have been reported.
        existing: Replies that name these tokens.
    """

    def __init__(
        self,
        callback: Callable[[str, bool], None],
        own: Mapping[str, Declared],
        live: Callable[[], list[str]],
    ) -> None:
        self.complete: Callable[[], object] | None = None
        self.existing: Replies | None = None
        self._callback = callback
        self._own = own
        self._live = live
        self._named: set[str] = set()
        self._seen: set[str] = set()
        self._appeared: set[str] = set()
        self._gone: set[str] = set()
        self._settled = time.monotonic() + _UNSETTLED_SECONDS

    def begin(self) -> None:
        """Wait for the tokens that a query finds."""
        if self.existing is not None:
            replies, self.existing = self.existing, None
            self._named = {reply.key for reply in replies if reply.ok}
            del replies

    def deliver(self, sample: zenoh.Sample) -> None:
        """Report that a token appeared or disappeared."""
        token, alive = str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT
        self._note(token, alive=alive)
        # Before the watch is complete, one query for all of these comes at the end.
        ended = alive and self.complete is None and token in self._gone
        if not (ended and self._ended({token})):
            self._report(token, alive)

    def idle(self) -> None:
        """Report that all tokens that existed have been reported, if they have."""
        report = self.complete
        if report is None:
            return
        # The watch is not told of a token whose process died while the watch began.
        self._named -= self._ended(self._named - self._seen)
        if self._named <= self._seen:
            for token in self._ended(self._appeared - (self._named - self._gone)):
                self._report(token, False)  # it disappeared unnoticed
            self.complete = None
            report()

    def _ended(self, tokens: set[str]) -> set[str]:
        """Return those of some tokens that are not alive."""
        with suppress(ClosedError, TransportError):
            for look in range(_LOOKS):
                if tokens:
                    time.sleep(LOOK_SECONDS if look else 0.0)
                    tokens = tokens.difference(self._live())
            return tokens
        return set()  # the watch ends with its session

    def _report(self, token: str, alive: bool) -> None:
        own = self._own.get(token)
        # See `tests/upstream/own_token.py`: it may have disappeared somewhere else only.
        if alive or own is None or own.closed:
            self._callback(token, alive)

    def _note(self, token: str, *, alive: bool) -> None:
        if self.complete is not None:
            self._seen.add(token)
        elif time.monotonic() > self._settled:
            self._appeared.clear()
            self._gone.clear()
            return
        if alive:
            self._appeared.add(token)
        elif token not in self._appeared:
            self._gone.add(token)  # one that was told of before may truly come again
