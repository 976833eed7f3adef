"""The replicas that are alive, by their liveliness tokens."""

from __future__ import annotations

import logging
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


class Members:
    """All replicas of a domain except for the one of this session.

    Args:
        session: Session to find them with.
        keys: Keys of the domain.

    Attributes:
        zids: Zenoh ids of their sessions; the set is replaced, never changed in place.
    """

    def __init__(self, session: Session, keys: Keys) -> None:
        self.zids: frozenset[str] = frozenset()
        self._session = session
        self._keys = keys
        self._found: dict[str, Member] = {}
        self._on_change: Callable[[Member, bool], None] | None = None
        self._watch: Closable | None = None
        self._watched: set[str] = set()

    def follow(self, on_change: Callable[[Member, bool], None], timeout: float) -> None:
        """Find the replicas that are alive, and watch for all that come and go from then on.

        Args:
            on_change: Function called on a Zenoh thread with each replica that comes or goes later,
                and whether it came.
            timeout: Time limit in seconds of the search for replicas that are alive.

        Raises:
            ClosedError: The session is closed.
        """
        # The search comes first: once tokens are watched, Zenoh answers it from what the watch has
        # seen so far.
        for token in self._session.live_tokens(self._keys.tokens, timeout):
            member = self._read(token)
            if member is not None:
                self._update(member, True)
        self._on_change = on_change
        self._watch = self._session.watch_tokens(self._keys.tokens, self._on_token)

    def drop_stale(self) -> None:
        """Forget replicas that went before the watch began; call it some time after that."""
        for zid in self.zids - self._watched:
            member = self._found.get(zid)
            if member is not None:
                self._update(member, False)

    def all(self) -> list[Member]:
        """Return the replicas, oldest first."""
        return sorted(self._found.copy().values())

    def oldest(self) -> Member | None:
        """Return the oldest replica; ``None`` if there is none."""
        return min(self._found.copy().values(), default=None)

    def label(self, zid: str) -> str:
        """Return the process of a replica, as shown to users."""
        member = self._found.get(zid)
        return member.label if member is not None else f"session {zid}"

    def close(self) -> None:
        """Stop watching; a second call has no effect."""
        if self._watch is not None:
            self._watch.close()

    def _on_token(self, token: str, alive: bool) -> None:
        member = self._read(token)
        if member is None:
            return
        if alive:
            self._watched.add(member.zid)
        else:
            self._watched.discard(member.zid)
        self._update(member, alive)

    def _read(self, token: str) -> Member | None:
        try:
            member = self._keys.member(token)
        except DecodeError as error:
            _log.warning("%s", error)
            return None
        return None if member.zid == self._session.zid else member

    def _update(self, member: Member, alive: bool) -> None:
        if alive and self._found.get(member.zid) == member:
            return
        if alive:
            self._found[member.zid] = member
        else:
            self._found.pop(member.zid, None)
        self.zids = frozenset(self._found.copy())
        if self._on_change is not None:
            self._on_change(member, alive)


class Core:
    """What the parts of one copy of the store share.

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
