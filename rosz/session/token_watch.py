"""Reports of a watch of tokens, and of the end of those that existed at its beginning."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import zenoh

from rosz.errors import ClosedError, TransportError
from rosz.session.declared import Declared
from rosz.session.queries import Replies

__all__ = ("TokenWatch",)


class TokenWatch:
    """Reports tokens, on the thread of its watch.

    Seen with eclipse-zenoh 1.10.2: a watch that begins while tokens disappear may be told of the
    end of some of these first, and then that they exist. `tests/interop/test_hostile.py` shows it;
    it is not reported upstream yet.

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
        self.complete: Callable[[], None] | None = None
        self.existing: Replies | None = None
        self._callback = callback
        self._own = own
        self._live = live
        self._missing: set[str] = set()
        self._seen: set[str] = set()
        self._appeared: set[str] = set()
        self._gone: set[str] = set()

    def begin(self) -> None:
        """Wait for the tokens that a query finds."""
        if self.existing is not None:
            replies, self.existing = self.existing, None
            self._missing = {reply.key for reply in replies if reply.ok}
            del replies

    def deliver(self, sample: zenoh.Sample) -> None:
        """Report that a token appeared or disappeared."""
        token, alive = str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT
        if self.complete is not None:
            self._note(token, alive=alive)
        own = self._own.get(token)
        # See `tests/upstream/own_token.py`: it may have disappeared somewhere else only.
        if alive or own is None or own.closed:
            self._callback(token, alive)

    def idle(self) -> None:
        """Report that what existed is complete, if it is."""
        report = self.complete
        if report is not None and self._missing <= self._seen:
            for token in self._vanished():
                self._callback(token, False)
            self.complete = None
            report()

    def _note(self, token: str, *, alive: bool) -> None:
        self._seen.add(token)
        if alive:
            self._appeared.add(token)
        else:
            self._appeared.discard(token)
            self._gone.add(token)

    def _vanished(self) -> set[str]:
        """Return the tokens that have disappeared unnoticed."""
        doubtful = self._appeared & self._gone
        if not doubtful:
            return doubtful
        try:
            return doubtful.difference(self._live())
        except (ClosedError, TransportError):
            return set()  # the watch ends with its session
