"""The tokens of a copy of the store, and those of others that it follows."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any

from rosz.errors import DecodeError
from rosz.lifecycle import Closable
from rosz.params.replica.core import effects, events
from rosz.params.replica.runner import CoreRunner
from rosz.params.wire import Keys
from rosz.session import Session


class Tokens:
    """Shows a copy of the store to others, and reports those that there are to its core.

    Args:
        session: Session of the copy.
        keys: Keys of the domain.
        runner: The core that is run.
    """

    def __init__(self, session: Session, keys: Keys, runner: CoreRunner) -> None:
        self._session = session
        self._keys = keys
        self._runner = runner
        self._member = runner.core.config.member
        self._token: Closable | None = None
        self._seed_token: Closable | None = None
        self._watch: Closable | None = None
        self._seed_watch: Closable | None = None
        self._lock = threading.RLock()
        self._closed = False
        runner.handlers |= {
            effects.DeclareToken: partial(self._submit, self._declare_token),
            effects.DeclareSeed: partial(self._submit, self._declare_seed),
            effects.UndeclareSeed: partial(self._submit, self._undeclare_seed),
            effects.FollowAll: partial(self._submit, self._follow_all),
            effects.UnfollowAll: partial(self._submit, self._unfollow_all),
        }

    def follow_seeds(self, timeout: float) -> None:
        """Watch seeds from now on, and wait until those that exist are known.

        Args:
            timeout: Time limit in seconds.

        Raises:
            ClosedError: The session is closed.
        """
        complete = threading.Event()
        on_token = partial(self._on_token, None)
        self._seed_watch = self._session.watch_tokens(self._keys.seeds, on_token, complete.set)
        complete.wait(timeout)

    def close(self) -> None:
        """Undeclare everything; a second call has no effect."""
        with self._lock:
            self._closed = True
        for declared in (self._token, self._seed_token, self._seed_watch, self._watch):
            if declared is not None:
                declared.close()

    def _submit(self, handle: Callable[[Any], object], effect: effects.Effect) -> None:
        self._runner.worker.submit(partial(self._unless_closed, handle, effect))

    def _unless_closed(self, handle: Callable[[Any], object], effect: effects.Effect) -> None:
        with self._lock:
            if not self._closed:
                handle(effect)

    def _declare_token(self, _: effects.DeclareToken) -> None:
        self._token = self._session.token(self._keys.token(self._member))

    def _declare_seed(self, _: effects.DeclareSeed) -> None:
        self._seed_token = self._session.token(self._keys.seed_token(self._member))

    def _undeclare_seed(self, _: effects.UndeclareSeed) -> None:
        token, self._seed_token = self._seed_token, None
        if token is not None:
            token.close()

    def _follow_all(self, effect: effects.FollowAll) -> None:
        number = effect.watch

        def on_complete() -> None:
            self._runner.run(events.MembersKnown(number))

        self._watch = self._session.watch_tokens(
            self._keys.tokens, partial(self._on_token, number), on_complete, many=True
        )

    def _unfollow_all(self, _: effects.UnfollowAll) -> None:
        watch, self._watch = self._watch, None
        if watch is not None:
            watch.close()

    def _on_token(self, watch: int | None, token: str, alive: bool) -> None:  # a callback
        """Report a token of a replica that is followed, or of a seed without a number."""
        try:
            member = self._keys.member(token)
        except DecodeError as error:
            self._runner.report("a token is not that of a replica", error)
            return
        if member.zid == self._session.zid:
            return
        if watch is None:
            self._runner.run(events.SeedCame(member) if alive else events.SeedWent(member.zid))
        else:
            self._runner.run(
                events.MemberCame(watch, member) if alive else events.MemberWent(watch, member.zid)
            )
