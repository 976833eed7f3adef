"""Joining the other replicas: getting what they have from the first that has joined and replies."""

from __future__ import annotations

import logging
from typing import Final

import msgspec

from rosz.params.replica.core.comparisons import Compared, Comparisons
from rosz.params.replica.core.effects import Answer, DeclareToken, FindStoppedPeers, ReadStorages
from rosz.params.replica.core.events import JoinCalled, Loaded, StoragesRead
from rosz.params.replica.core.members import Members
from rosz.params.replica.core.seeds import Seeding
from rosz.params.replica.core.store import Store
from rosz.params.replica.core.work import Work

FIND: Final = "find"
NEXT: Final = "query the next"
MORE: Final = "find more"
_JOINING: Final = "joining"
_FIND_TIMEOUT: Final = 10.0
"""Seconds that the first search may take; it takes milliseconds, or more if many start at once."""

_NEXT_AFTER: Final = 0.3
"""Seconds after which a joining replica queries the next replica as well. They double with each
query: otherwise many replicas that start together would overload the others."""

_TIMEOUT: Final = 30.0
_WARN_AFTER: Final = 5.0
"""Seconds after which a replica that cannot join warns; 100 that start at once need seconds."""

_MORE_TIMEOUT: Final = 0.5


class Joining(msgspec.Struct, eq=False):
    """Fetches the writes of the other replicas when a replica starts.

    Args:
        work: Gives the time of the step, and collects its effects.
        store: The writes of this replica.
        members: The other replicas.
        seeding: Whether this replica is a seed.
        comparisons: The comparisons with the others.

    Attributes:
        done: Whether joining has ended.
        call: Number of the call that waits for its end.
        becomes_seed: Whether the replica becomes a seed at its end.
        known_at_start: Sessions of the other replicas that were visible when it began.
    """

    _work: Work
    _store: Store
    _members: Members
    _seeding: Seeding
    _comparisons: Comparisons
    done: bool = False
    call: int = 0
    becomes_seed: bool = False
    known_at_start: frozenset[str] = frozenset()
    _finding: bool = False
    _active: bool = False
    _began: float = 0.0
    _asked: list[str] = msgspec.field(default_factory=list)
    _pending: set[str] = msgspec.field(default_factory=set)
    _finding_all: bool = False
    _find_all_begun: bool = False
    _warned: bool = False

    def begin(self, event: JoinCalled) -> None:
        """Find others, unless it is known already whether there are any."""
        self.call = event.call
        self._finding = True
        if self._seeding.prepare():
            self.enter()
        else:
            self._work.later(_FIND_TIMEOUT, FIND)

    def enter(self, _: int = 0) -> None:
        """Declare the token, and query the replicas that were found; without any, read storages."""
        if not self._finding:
            return
        self._finding = False
        self.becomes_seed = self._seeding.decide()
        self.known_at_start = self._members.zids
        listens = self._work.config.listens
        if not listens:
            self._work.do(DeclareToken())
        if self._members.zids:
            self._active = True
            self._began = self._work.now.seconds
            self.query_next()
        elif listens:
            self._work.do(Answer(self.call, False))
        else:
            self._work.do(ReadStorages())

    def on_storages_read(self, event: StoragesRead) -> None:
        """Load the writes that other programs have stored, unless this replica has joined."""
        if not self.done:
            self._store.load(Loaded(event.writes))
            self._store.disk.save(event.writes)
            self._end()

    def query_next(self) -> None:
        """Compare with the next replica; if all are compared with, find more replicas."""
        if not self._active or self._finding_all:
            return
        unasked = self._unasked()
        if unasked:
            zid = unasked[0]
            self._asked.append(zid)
            self._pending.add(zid)
            self._comparisons.start(zid, self.call)
            self._wait()
        elif not self._pending:
            self._find_all()

    def on_compared(self, compared: Compared) -> None:
        """Handle the end of a comparison."""
        if compared.waiter != self.call or not self._active:
            return
        self._pending.discard(compared.zid)
        if compared.good and compared.joined:
            self._end()
        else:
            self.query_next()

    def on_timer(self, number: int) -> None:
        """Query the next replica, or give up, when the newest query takes too long."""
        if not self._active or number != len(self._asked):
            return
        passed = self._work.now.seconds - self._began
        if passed >= _TIMEOUT:
            self._warn(passed)
            self._end()
        elif self._unasked():
            self.query_next()
        else:
            self._wait()
            self._work.do(FindStoppedPeers())

    def on_peers_stopped(self, zids: frozenset[str]) -> None:
        """Find all replicas if the known ones are stopped, or joining takes long.

        If that was done already, warn, and give up if all are stopped.
        """
        passed = self._work.now.seconds - self._began
        are_stopped = zids >= self._members.zids
        if not self._active or self._finding_all or not (are_stopped or passed > _WARN_AFTER):
            return
        if not self._find_all_begun:
            self._find_all()
            return
        if not self._warned:
            self._warn(passed)
        if are_stopped:
            self._end()

    def on_search_ended(self, _: int = 0) -> None:
        """Handle that all replicas are known, or that the time limit of the search is over."""
        if self._finding_all and self._active:
            self._finding_all = False
            if self._unasked() or self._pending:
                self.query_next()
            else:
                self._end()

    def _find_all(self) -> None:
        """Find all replicas, not only seeds; give up if that was done already."""
        if self._find_all_begun:
            self._end()
            return
        self._find_all_begun = self._finding_all = True
        if self._members.follow(_JOINING):
            self.on_search_ended()
        else:
            self._work.later(_MORE_TIMEOUT, MORE)

    def _unasked(self) -> list[str]:
        return [member.zid for member in self._members.all() if member.zid not in self._asked]

    def _wait(self) -> None:
        seconds = min(_NEXT_AFTER * 2 ** (len(self._asked) - 1), _WARN_AFTER)
        self._work.later(seconds, NEXT, len(self._asked))

    def _warn(self, seconds: float) -> None:
        self._warned = True
        labels = ", ".join(self._members.label(zid) for zid in self._asked)
        self._work.log(
            logging.WARNING, f"no replica of the parameters answered in {seconds:.2g} s: {labels}"
        )

    def _end(self) -> None:
        self.done, self._active = True, False
        self._members.unfollow(_JOINING)
