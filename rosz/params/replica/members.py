"""The replicas that are alive, by their liveliness tokens.

A replica follows the tokens of elders, which are a few of all replicas, whatever their number: it
joins from one of them and compares with them. Elders follow all replicas, and so does whoever
writes, to know who has to acknowledge that. The tokens of all would cost each replica as much as
there are others.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any

from rosz.errors import DecodeError
from rosz.lifecycle import Closable
from rosz.params.replica.state import State
from rosz.params.wire import Keys, Member
from rosz.session import Session
from rosz.worker import Worker

__all__ = ("Core", "Members")

_log = logging.getLogger("rosz.params")

_OnChange = Callable[[Member, bool], None]
"""Function called with a replica that comes or goes, and whether it comes."""


class Members:
    """Other replicas of a domain: the elders, and all of them as long as somebody needs them.

    Args:
        session: Session to find them with.
        keys: Keys of the domain.

    Attributes:
        zids: Zenoh ids of the sessions of those known; the set is replaced, never changed in place.
    """

    def __init__(self, session: Session, keys: Keys) -> None:
        self.zids: frozenset[str] = frozenset()
        self._session = session
        self._keys = keys
        self._elders: dict[str, Member] = {}
        self._found: dict[str, Member] = {}
        self._on_elder: _OnChange | None = None
        self._on_member: _OnChange | None = None
        self._watches: list[Closable] = []
        self._complete = threading.Event()
        self._reasons: set[str] = set()
        # A signal handler that writes may interrupt its own thread.
        self._lock = threading.RLock()

    def follow(self, on_elder: _OnChange, on_member: _OnChange, timeout: float) -> None:
        """Find the elders, and watch for those that come and go from then on.

        Args:
            on_elder: Function called on a watch's thread with each elder that comes or goes later.
            on_member: Function called on a watch's thread with each replica that comes or goes
                while all are followed.
            timeout: Time limit in seconds of the search for elders that exist.

        Raises:
            ClosedError: The session is closed.
        """
        known = threading.Event()
        self._on_member = on_member
        watch = self._session.watch_tokens(self._keys.elders, self._on_elder_token, known.set)
        self._watches.append(watch)
        known.wait(timeout)
        self._on_elder = on_elder

    def follow_all(self, reason: str, timeout: float = 0.0) -> None:
        """Follow all replicas, until this is undone for each reason to do so.

        Args:
            reason: What needs them.
            timeout: Time limit in seconds of the search for those that exist.

        Raises:
            ClosedError: The session is closed.
        """
        if reason not in self._reasons:
            with self._lock:
                first = not self._reasons
                self._reasons.add(reason)
                if first:
                    self._watches.append(self._watch_all())
        if not self._complete.is_set():
            self._complete.wait(timeout)

    def unfollow_all(self, reason: str) -> None:
        """Undo `follow_all` for one reason."""
        with self._lock:
            if reason in self._reasons:
                self._reasons.discard(reason)
                if not self._reasons:
                    self._watches.pop().close()
                    self._complete = threading.Event()
                    self._found = {}
                    self._count()

    def all(self) -> list[Member]:
        """Return the replicas that are known, oldest first."""
        with self._lock:
            return sorted(self._known().values())

    def elders(self) -> list[Member]:
        """Return the elders, oldest first."""
        return sorted(self._elders.copy().values())

    def label(self, zid: str) -> str:
        """Return the process of a replica, as shown to users."""
        member = self._found.get(zid) or self._elders.get(zid)
        return member.label if member is not None else f"session {zid}"

    def close(self) -> None:
        """Stop watching; a second call has no effect."""
        for watch in self._watches:
            watch.close()

    def _watch_all(self) -> Closable:
        complete = self._complete
        self._found = {}

        def on_token(token: str, alive: bool) -> None:
            if complete is self._complete:
                self._on_token(token, alive)

        def on_complete() -> None:
            with self._lock:
                complete.set()
                self._count()

        return self._session.watch_tokens(self._keys.tokens, on_token, on_complete, many=True)

    def _on_elder_token(self, token: str, alive: bool) -> None:
        self._update(self._elders, token, alive, self._on_elder)

    def _on_token(self, token: str, alive: bool) -> None:
        on_change = self._on_member if self._complete.is_set() else None
        self._update(self._found, token, alive, on_change)

    def _update(
        self, known: dict[str, Member], token: str, alive: bool, on_change: _OnChange | None
    ) -> None:
        try:
            member = self._keys.member(token)
        except DecodeError as error:
            _log.warning("%s", error)
            return
        if member.zid == self._session.zid or (alive and known.get(member.zid) == member):
            return
        with self._lock:
            if alive:
                known[member.zid] = member
            else:
                known.pop(member.zid, None)
            self._count()
        if on_change is not None:
            on_change(member, alive)

    def _known(self) -> dict[str, Member]:
        return self._found if self._complete.is_set() else self._elders | self._found

    def _count(self) -> None:
        self.zids = frozenset(self._known())


class Core:
    """The state that the parts of one copy of the store share.

    Args:
        session: Session of the copy.
        domain: ROS domain.
        worker: Worker that all tasks of the copy run on.

    Attributes:
        session: The argument.
        worker: The argument.
        keys: Keys of the domain.
        state: State of the copy.
        members: Other replicas.
    """

    def __init__(self, session: Session, domain: int, worker: Worker[Any]) -> None:
        self.session = session
        self.worker = worker
        self.keys: Keys = Keys(domain, scoped=session.secured)
        self.state: State = State(session.clock)
        self.members: Members = Members(session, self.keys)
