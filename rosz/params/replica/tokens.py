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
        self._declared: dict[str, Closable] = {}
        self._lock = threading.RLock()
        self._closed = False
        member = runner.core.config.member
        runner.handlers |= {
            effects.DeclareToken: self._replacing("", lambda _: session.token(keys.token(member))),
            effects.DeclareSeed: self._replacing(
                "seed", lambda _: session.token(keys.token(member, seed=True))
            ),
            effects.UndeclareSeed: self._replacing("seed"),
            effects.FollowAll: self._replacing("all", self._follow_all),
            effects.UnfollowAll: self._replacing("all"),
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
        watch = self._session.watch_tokens(self._keys.seeds, on_token, complete.set)
        self._declared["seeds"] = watch
        complete.wait(timeout)

    def close(self) -> None:
        """Undeclare everything; a second call has no effect."""
        with self._lock:
            self._closed = True
        for declared in self._declared.values():
            declared.close()

    def _replacing(
        self, name: str, declare: Callable[[Any], Closable | None] = lambda _: None
    ) -> Callable[[Any], object]:
        """Return the handler of an effect that takes the place of what has a name, if anything."""

        def replace(effect: effects.Effect) -> None:
            with self._lock:
                if self._closed:
                    return
                before = self._declared.pop(name, None)
                if before is not None:
                    before.close()
                declared = declare(effect)
                if declared is not None:
                    self._declared[name] = declared

        return lambda effect: self._runner.worker.submit(partial(replace, effect))

    def _follow_all(self, effect: effects.FollowAll) -> Closable:
        return self._session.watch_tokens(
            self._keys.tokens,
            partial(self._on_token, effect.watch),
            lambda: self._runner.run(events.MembersKnown(effect.watch)),
            many=True,
        )

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
