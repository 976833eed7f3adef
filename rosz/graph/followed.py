"""A part of the graph that is followed: live tokens, listeners, and waiting for a condition."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterable
from typing import Any

from rosz.errors import ClosedError, WaitTimeout
from rosz.graph.interests import Interest, Interests
from rosz.graph.view import View
from rosz.lifecycle import Closing
from rosz.session import clamp_timeout
from rosz.wire import Token

GraphListener = Callable[[Token, bool], None]
"""Function called with a token, and whether it appeared (true) or disappeared (false)."""

_numbers = itertools.count()


class Followed(Closing):
    """The tokens that match some key expressions, followed until this is closed.

    Args:
        interests: The interests of the graph.
        keys: The key expressions, each with the name that the tokens must have, or none.
        many: Whether hundreds of tokens may match each of them.

    Raises:
        ClosedError: The graph or its session is closed.
    """

    def __init__(
        self, interests: Interests, keys: Iterable[tuple[str, str]], *, many: bool = False
    ) -> None:
        self._graph = interests
        self._interests: tuple[Interest, ...] = tuple(interests.acquire(keys, many=many))
        self._latest: tuple[int, View] | None = None
        self._closed = False

    @property
    def complete(self) -> bool:
        """Whether the tokens that existed at its start are known, or that takes too long."""
        return all(interest.settled for interest in self._interests)

    def share(self) -> None:
        """Give these tokens to all that follow single names from now on; never close this then."""
        self._graph.draw_on(self._interests)

    def view(self) -> View:
        """Return the tokens known at this moment; before `complete` some may be missing."""
        latest = self._latest  # replaced whole, so that reading it needs no lock
        if latest is not None and latest[0] == self._version():
            return latest[1]
        with self._graph.changed:
            version = self._version()
            view = View.of(
                token for interest in self._interests for token in interest.tokens.values()
            )
            self._latest = version, view
            return view

    def refresh(self, timeout: float) -> View:
        """Return the known tokens and those of a query, for callers that cannot wait for tokens.

        Args:
            timeout: Time limit in seconds.

        Raises:
            ClosedError: The session is closed.
            UsageError: The timeout is not a number.
        """
        return self._graph.query(
            self._interests, [interest.key for interest in self._interests], timeout
        )

    def listen(self, listener: Callable[[Any, bool], None]) -> Callable[[], None]:
        """Call a function for existing tokens, then for every change, on the graph's thread.

        Args:
            listener: Function called with each token that appears or disappears, in order;
                exceptions are logged.

        Returns:
            A function that unregisters the listener.
        """
        number = next(_numbers)
        for interest in self._interests:
            self._graph.register(interest, number, listener)

        def unregister() -> None:
            for interest in self._interests:
                self._graph.unregister(interest, number)

        return unregister

    def wait_for(
        self, condition: Callable[[View], bool], timeout: float, what: str, hint: str = ""
    ) -> View:
        """Wait until the followed tokens meet a condition.

        Args:
            condition: Function that tells whether a view meets it.
            timeout: Time limit in seconds.
            what: Name of the condition, for the error.
            hint: Advice at the end of the error text.

        Returns:
            The view that met the condition.

        Raises:
            WaitTimeout: The time limit was reached.
            ClosedError: The graph was closed meanwhile.
            UsageError: The timeout is not a number.
        """
        views: list[View] = []

        def is_met() -> bool:
            # An incomplete view could meet a condition that the complete one does not meet.
            if not self.complete and time.monotonic() < deadline:
                return False
            view = self.view()
            if condition(view):
                views.append(view)
            return bool(views)

        deadline = time.monotonic() + clamp_timeout(timeout)
        if self._graph.wait_until(is_met, deadline):
            return views[0]
        if self._graph.closing:
            raise ClosedError(f"the wait for {what} ended: shutting down")
        raise WaitTimeout(what, timeout, hint)

    def close(self) -> None:
        """Stop following the tokens; a second call has no effect."""
        closed, self._closed = self._closed, True
        if not closed:
            self._graph.release(self._interests)

    def _version(self) -> int:
        return sum(interest.version for interest in self._interests)
