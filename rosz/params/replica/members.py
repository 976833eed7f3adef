"""The replicas that are alive, by their liveliness tokens."""

from __future__ import annotations

import logging
from collections.abc import Callable

from rosz.errors import DecodeError
from rosz.lifecycle import Closable
from rosz.params.keys import Keys, Member
from rosz.session import Session

__all__ = ("Members",)

_log = logging.getLogger("rosz.params")


class Members:
    """All replicas of a domain except for this one.

    Args:
        session: Where to look.
        keys: The keys of the domain.

    Attributes:
        zids: Their sessions; replaced, never changed in place.
    """

    def __init__(self, session: Session, keys: Keys) -> None:
        self.zids: frozenset[str] = frozenset()
        self._session = session
        self._keys = keys
        self._found: dict[str, Member] = {}
        self._changed: Callable[[Member, bool], None] | None = None
        self._watch: Closable | None = None
        self._watched: set[str] = set()

    def follow(self, changed: Callable[[Member, bool], None], timeout: float) -> None:
        """Find those that are there, and look out for all that come and go from then on.

        Args:
            changed: Gets a replica and whether it appeared, on a Zenoh thread; not those that are
                there already.
            timeout: Seconds to look for those.

        Raises:
            ClosedError: The session is closed.
        """
        # In this order: once tokens are watched, Zenoh answers from what the watch has seen so far.
        self.look(timeout)
        self._changed = changed
        self._watch = self._session.watch_tokens(self._keys.tokens, self._on_watched)

    def look(self, timeout: float) -> None:
        """Ask for those that are there now.

        Args:
            timeout: Seconds.

        Raises:
            ClosedError: The session is closed.
        """
        for token in self._session.live_tokens(self._keys.tokens, timeout):
            member = self._read(token)
            if member is not None:
                self._take(member, True)

    def drop_ghosts(self) -> None:
        """Forget those that were gone before the watch began; call it some time after that."""
        for zid in self.zids - self._watched:
            member = self._found.get(zid)
            if member is not None:
                self._take(member, False)

    def all(self) -> list[Member]:
        """Return them, the oldest first."""
        return sorted(self._found.copy().values())

    def label(self, zid: str) -> str:
        """Return what people call a replica."""
        member = self._found.get(zid)
        return member.label if member is not None else f"session {zid}"

    def close(self) -> None:
        """Look no more; again is no error."""
        if self._watch is not None:
            self._watch.close()

    def _on_watched(self, token: str, alive: bool) -> None:
        member = self._read(token)
        if member is None:
            return
        if alive:
            self._watched.add(member.zid)
        else:
            self._watched.discard(member.zid)
        self._take(member, alive)

    def _read(self, token: str) -> Member | None:
        try:
            member = self._keys.member(token)
        except DecodeError as error:
            _log.warning("%s", error)
            return None
        return None if member.zid == self._session.zid else member

    def _take(self, member: Member, alive: bool) -> None:
        if alive and self._found.get(member.zid) == member:
            return
        if alive:
            self._found[member.zid] = member
        else:
            self._found.pop(member.zid, None)
        self.zids = frozenset(self._found.copy())
        if self._changed is not None:
            self._changed(member, alive)
