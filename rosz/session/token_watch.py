"""Reports of a watch of tokens, and of the end of those that existed at its beginning."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from itertools import takewhile

import zenoh

from rosz.errors import ClosedError, TransportError
from rosz.session.declared import Declared
from rosz.session.queries import Replies

_RECENT_SECONDS = 5.0
"""Seconds after the end of a token in which a report that it exists may be an old one."""
_LOOKS = 3
"""Queries that must all miss a token before it counts as ended."""


class TokenWatch:
    """Reports tokens, on the thread of its watch.

    Seen with eclipse-zenoh 1.10.2: a session whose watch begins while tokens disappear may be told
    of the end of some of these first, and then that they exist. It remembers these for ever, and
    reports them to each watch that begins later, but not to queries.
    `tests/session/test_token_watch.py` shows it; it is not reported upstream yet. Only for such
    tokens queries decide: while tokens come and go, a query may miss some that exist.

    Args:
        callback: Function called with the key of a token, and with whether it appeared (true) or
            disappeared (false).
        own: The tokens of the session by their keys.
        stale: The tokens that the session remembers wrongly; all its watches share them.
        live: Function that returns the keys of the tokens that are alive, by a query.

    Attributes:
        complete: Function called once the tokens that existed at the beginning have been reported.
        existing: Replies that name these tokens.
    """

    def __init__(
        self,
        callback: Callable[[str, bool], None],
        own: Mapping[str, Declared],
        stale: set[str],
        live: Callable[[], list[str]],
    ) -> None:
        self.complete: Callable[[], None] | None = None
        self.existing: Replies | None = None
        self._callback = callback
        self._own = own
        self._stale = stale
        self._live = live
        self._found: frozenset[str] = frozenset()
        self._missing: set[str] = set()
        self._seen: set[str] = set()
        self._appeared: set[str] = set()
        self._ended: dict[str, float] = {}
        self._doubtful: set[str] = set()

    def begin(self) -> None:
        """Wait for the tokens that a query finds."""
        if self.existing is not None:
            replies, self.existing = self.existing, None
            self._found = frozenset(reply.key for reply in replies if reply.ok)
            self._missing = set(self._found)
            del replies

    def deliver(self, sample: zenoh.Sample) -> None:
        """Report that a token appeared or disappeared."""
        token, alive = str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT
        if self.complete is not None:
            self._seen.add(token)
        if not alive:
            self._note_end(token)
        elif self.complete is not None:
            self._appeared.add(token)  # `idle` looks for all of these at once, as for the doubtful
        elif token in self._stale or self._ended_recently(token):
            self._doubtful.add(token)
            return
        # See `tests/upstream/own_token.py`: it may have disappeared somewhere else only.
        if alive or not self._is_own(token):
            self._callback(token, alive)

    def idle(self) -> None:
        """Report doubtful tokens, and that all tokens that existed have been reported."""
        report = self.complete
        if report is not None:
            if not self._is_complete():
                return
            doubtful = (self._appeared - self._found) | (self._appeared & self._ended.keys())
            for token in self._without_live(doubtful):
                self._callback(token, False)
            self.complete = None
            report()
        if self._doubtful:
            doubtful, self._doubtful = self._doubtful, set()
            for token in doubtful - self._without_live(doubtful):
                self._callback(token, True)

    def _is_complete(self) -> bool:
        """Return whether all tokens of the query have been reported, but those that ended before.

        The watch is not told of a token whose process died while the watch began.
        """
        missing = self._missing - self._seen
        if missing:
            self._missing = missing.intersection(self._alive(missing))
        return self._missing <= self._seen

    def _is_own(self, token: str) -> bool:
        own = self._own.get(token)
        return own is not None and not own.closed

    def _without_live(self, tokens: set[str]) -> set[str]:
        """Return those of some tokens of others that no query finds, and remember them as stale."""
        rest = {token for token in tokens if not self._is_own(token)}
        for _ in range(_LOOKS):
            if rest:
                rest -= self._alive(rest)
        self._stale -= tokens
        self._stale |= rest
        return rest

    def _alive(self, otherwise: set[str]) -> set[str]:
        try:
            return set(self._live())
        except (ClosedError, TransportError):
            return otherwise  # the watch ends with its session

    def _note_end(self, token: str) -> None:
        self._doubtful.discard(token)
        self._ended.pop(token, None)
        self._ended[token] = time.monotonic()
        for key in tuple(takewhile(lambda key: not self._ended_recently(key), self._ended)):
            del self._ended[key]

    def _ended_recently(self, token: str) -> bool:
        return time.monotonic() - self._ended.get(token, -_RECENT_SECONDS) < _RECENT_SECONDS
