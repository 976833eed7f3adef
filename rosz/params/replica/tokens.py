"""The tokens of a copy of the store, and those of others that it follows."""

from __future__ import annotations

import logging
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

_log = logging.getLogger("rosz.params")


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
        self._handlers: dict[type[effects.Effect], Callable[[Any], object]] = {
            effects.DeclareToken: self._declare_token,
            effects.DeclareSeed: self._declare_seed,
            effects.UndeclareSeed: self._undeclare_seed,
            effects.FollowAll: self._follow_all,
            effects.UnfollowAll: self._unfollow_all,
        }

    def follow_seeds(self, timeout: float) -> None:
        """Watch seeds from now on, and wait until those that exist are known.

        Args:
            timeout: Time limit in seconds.

        Raises:
            ClosedError: The session is closed.
        """
        complete = threading.Event()
        self._seed_watch = self._session.watch_tokens(self._keys.seeds, self._on_seed, complete.set)
        complete.wait(timeout)

    def carry_out(self, effect: effects.Effect) -> None:
        """Carry out an effect, on the worker."""
        handle = self._handlers.get(type(effect))
        if handle is not None:
            self._runner.worker.submit(partial(self._unless_closed, handle, effect))

    def close(self) -> None:
        """Undeclare everything; a second call has no effect."""
        with self._lock:
            self._closed = True
        for declared in (self._token, self._seed_token, self._seed_watch, self._watch):
            if declared is not None:
                declared.close()

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
            self._keys.tokens,
            partial(self._on_token, number),
            on_complete,
            many=True,
        )

    def _unfollow_all(self, _: effects.UnfollowAll) -> None:
        watch, self._watch = self._watch, None
        if watch is not None:
            watch.close()

    def _on_seed(self, token: str, alive: bool) -> None:  # a callback
        try:
            member = self._keys.member(token)
        except DecodeError as error:
            _log.warning("%s", error)
            return
        if member.zid != self._session.zid:
            self._runner.run(events.SeedCame(member) if alive else events.SeedWent(member.zid))

    def _on_token(self, watch: int, token: str, alive: bool) -> None:  # a callback
        try:
            member = self._keys.member(token)
        except DecodeError as error:
            _log.warning("%s", error)
            return
        if member.zid != self._session.zid:
            self._runner.run(
                events.MemberCame(watch, member) if alive else events.MemberWent(watch, member.zid)
            )
