"""Comparing with other replicas, and exchanging the writes that differ.

The messages are those of `rosz.params.wire`.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable
from typing import Final, NamedTuple

from rosz.errors import DecodeError
from rosz.params.history import EMPTY_DIGEST, Differences
from rosz.params.paths import Path, common_path
from rosz.params.replica.core.deliveries import Deliveries
from rosz.params.replica.core.effects import Reply, SendQuery
from rosz.params.replica.core.events import QueryEnded, SyncReceived, WritesReceived
from rosz.params.replica.core.members import Members
from rosz.params.replica.core.store import Store
from rosz.params.replica.core.work import Work, named
from rosz.params.wire import (
    Index,
    Record,
    SyncReply,
    SyncRequest,
    check_reach,
    join_path,
    split_path,
)
from rosz.params.writes import Write

APPEARED: Final = "appeared"
_DAMAGED_COMPARISON: Final = "a replica sent a damaged comparison"
_DAMAGED_WRITES: Final = "a replica sent damaged writes"
_TIMEOUT: Final = 5.0
_SPREAD: Final = 0.05
"""Seconds over which those that find each other spread their requests."""

_MAX_COMPARED: Final = 8
"""Replicas to compare with, of those that appear together; with more, a large start never ends."""

_MAX_INDEXES: Final = 3
"""Indexes that a comparison sends: while it lasts, a write may replace others in other buckets."""

_RETRY_REFUSED_AFTER: Final = 3600.0
"""Seconds before a refused write is sent again: the rules on the way may have changed."""

_Sent = tuple[str, Path, int, str]
"""A session, and the path, time and clock of a write that was sent to it."""


class Compared(NamedTuple):
    """The end of a comparison.

    Attributes:
        zid: Session of the other replica.
        waiter: Number of the call that waited for it; 0 if none.
        good: Whether both hold the same writes now.
        joined: Whether the other one had joined.
        shared: Number of the own batch up to which the other one has all.
    """

    zid: str
    waiter: int
    good: bool
    joined: bool
    shared: int


class _Comparison:
    """One exchange of differences with one replica, from the digest to the last missing write."""

    def __init__(self, zid: str, newest: int, waiters: list[int]) -> None:
        self.zid = zid
        self.newest = newest
        self.waiters = waiters
        self.joined = False
        self.indexes = 0
        self.parts: list[list[Write]] = []
        self.sent: list[Write] = []


class Comparisons:
    """All exchanges of differences with other replicas.

    Args:
        work: Gives the time of the step, and collects its effects.
        store: The writes of this replica.
        members: The other replicas.
        deliveries: The own batches.

    Attributes:
        ready: Whether this replica has joined.
        ended: Comparisons that ended in this step.
    """

    def __init__(self, work: Work, store: Store, members: Members, deliveries: Deliveries) -> None:
        self.ready: bool = False
        self.ended: list[Compared] = []
        self._work = work
        self._store = store
        self._members = members
        self._deliveries = deliveries
        self._open: dict[str, _Comparison] = {}
        self._queries: dict[int, _Comparison] = {}
        self._again: dict[str, list[int]] = {}
        self._appeared: set[str] = set()
        self._refused: dict[_Sent, float] = {}
        self._unreported: dict[str, list[Path]] = {}

    @property
    def any_open(self) -> bool:
        """Whether any is under way."""
        return bool(self._open)

    def start(self, zid: str, waiter: int = 0, *, appoints: bool = False) -> None:
        """Compare with a replica, after the comparison that is under way if there is one.

        Args:
            zid: Its session.
            waiter: Number of the call that waits for it.
            appoints: Whether the other one has to become a seed.
        """
        waiters = [waiter] if waiter else []
        if zid in self._open:
            if waiter:
                self._again.setdefault(zid, []).append(waiter)
            return
        newest = self._deliveries.newest
        comparison = self._open[zid] = _Comparison(zid, newest, waiters)
        request = self._compose(digest=self._store.history.digest())
        request.appoints = appoints
        self._query(comparison, request)

    def start_soon(self, zid: str) -> None:
        """Compare with a replica that has appeared or lagged, after a random delay.

        Of many that appear together, such as those behind a restored link, a few are enough:
        they have exchanged their writes. Anti-entropy finds any that are missing even so.
        """
        if not self._appeared:
            self._work.later(self._work.random.uniform(0, _SPREAD), APPEARED)
        self._appeared.add(zid)

    def start_with_appeared(self, _: int = 0) -> None:
        """Compare with those that have appeared; called by a timer."""
        zids, self._appeared = sorted(self._appeared), set()
        for zid in self._work.random.sample(zids, min(len(zids), _MAX_COMPARED)):
            self.start(zid)

    def start_with_one(self) -> None:
        """Compare with a random seed, or with any replica if there is none."""
        self._trim_refused()
        zids = [member.zid for member in self._members.seeds()] or sorted(self._members.zids)
        if zids:
            self.start(self._work.random.choice(zids))

    def on_ended(self, event: QueryEnded) -> None:
        """Handle the end of a query."""
        comparison = self._queries.pop(event.number, None)
        if comparison is None:
            return
        try:
            if comparison.sent:
                self._on_sent(comparison, event)
            elif event.reply is None or event.failed:
                self._end(comparison, good=False)
            else:
                self._on_reply(comparison, event.reply)
        except DecodeError as error:
            label = self._members.label(comparison.zid)
            text = f"the replica in {label} sent a damaged reply (reported once): {error!s:.300}"
            self._work.log(logging.WARNING, text, once="damaged reply")
            self._end(comparison, good=False)

    def on_sync(self, event: SyncReceived) -> None:
        """Reply to a comparison of another replica."""
        try:
            reply = self._compare(event.request)
        except DecodeError as error:
            self._store.report(_DAMAGED_COMPARISON, error)
            self._work.do(Reply(event.query, str(error)))
        else:
            self._work.do(Reply(event.query, reply))

    def on_writes(self, event: WritesReceived) -> None:
        """Take writes that this replica lacks."""
        try:
            writes = [record.write() for record in event.request.records]
            check_reach((write.path for write in writes), event.reach)
        except DecodeError as error:
            self._store.report(_DAMAGED_WRITES, error)
            self._work.do(Reply(event.query, str(error)))
            return
        self._store.add(writes)
        self._work.do(Reply(event.query, SyncReply(digest=self._store.history.digest())))

    def forget(self, zid: str) -> None:
        """Forget what a replica refused: it may return, and was perhaps only out of reach."""
        self._unreported.pop(zid, None)
        for sent in [sent for sent in self._refused if sent[0] == zid]:
            del self._refused[sent]

    def _compare(self, request: SyncRequest) -> SyncReply:
        history = self._store.history
        differences = Differences([], [], ahead=False, behind=False)
        if request.index is not None:
            differences = history.compare(*request.index.content(), request.horizon)
        ahead = request.horizon < history.horizon or differences.ahead
        whole = ahead or request.digest == EMPTY_DIGEST
        writes = history.writes() if whole else differences.lacking
        behind = request.horizon > history.horizon or differences.behind
        if behind and request.sender in self._members.zids:
            self.start(request.sender)
        reply = SyncReply(history.digest(), self.ready, whole=ahead, horizon=history.horizon)
        reply.records = [Record.of(write) for write in writes]
        reply.wanted = [join_path(path) for path in differences.wanted]
        return reply

    def _compose(self, digest: bytes | None = None, index: Index | None = None) -> SyncRequest:
        return SyncRequest(digest, index, [], self._store.history.horizon, self._work.zid)

    def _on_reply(self, comparison: _Comparison, reply: SyncReply) -> None:
        writes = [record.write() for record in reply.records]
        if reply.whole:
            self._store.merge(writes, reply.horizon)
        else:
            self._store.add(writes)
        if not comparison.indexes:
            comparison.joined = reply.ready
        history = self._store.history
        candidates = [history.find(split_path(path)) for path in reply.wanted]
        wanted = [
            write for write in candidates if write and not self._is_refused(comparison, write)
        ]
        if wanted:
            comparison.parts.append(wanted)
        buckets = [] if reply.wanted else history.differing(reply.digest)
        if buckets and comparison.indexes < _MAX_INDEXES:
            comparison.indexes += 1
            index = Index.of(buckets, history.in_buckets(buckets))
            self._query(comparison, self._compose(index=index))
        else:
            self._send_next(comparison)

    def _send_next(self, comparison: _Comparison) -> None:
        if comparison.parts:
            comparison.sent = comparison.parts.pop()
            request = SyncRequest(records=[Record.of(write) for write in comparison.sent])
            self._query(comparison, request, [write.path for write in comparison.sent])
        else:
            self._report_refused(comparison.zid)
            self._end(comparison, good=True)

    def _on_sent(self, comparison: _Comparison, event: QueryEnded) -> None:
        writes, comparison.sent = comparison.sent, []
        # A query stays without a reply if rules forbid it, or if the link is gone.
        gone = comparison.zid not in self._members.zids
        if event.failed or gone or not (event.reply or self._work.config.scoped):
            self._end(comparison, good=False)
            return
        if event.reply is None:
            # Rules judge by the common path of all writes in a message: parts of it may pass.
            if len(writes) > 1:
                comparison.parts += _split(writes)
            else:
                self._refuse(comparison.zid, writes[0])
        self._send_next(comparison)

    def _query(
        self, comparison: _Comparison, request: SyncRequest, paths: list[Path] | None = None
    ) -> None:
        number = self._work.number()
        self._queries[number] = comparison
        self._work.do(SendQuery(number, comparison.zid, request, paths or [], _TIMEOUT))

    def _end(self, comparison: _Comparison, *, good: bool) -> None:
        zid, shared = comparison.zid, comparison.newest if good else 0
        del self._open[zid]
        for waiter in comparison.waiters or [0]:
            self.ended.append(Compared(zid, waiter, good, comparison.joined, shared))
        waiters = self._again.pop(zid, [])
        if waiters:
            self.start(zid)
            self._open[zid].waiters += waiters

    def _is_refused(self, comparison: _Comparison, write: Write) -> bool:
        sent = self._refused.get((comparison.zid, write.path, write.time, write.clock))
        return sent is not None and self._work.now.seconds - sent < _RETRY_REFUSED_AFTER

    def _refuse(self, zid: str, write: Write) -> None:
        """Remember that a replica refuses a write, so that not every comparison sends it again."""
        sent = (zid, write.path, write.time, write.clock)
        if sent not in self._refused:
            self._unreported.setdefault(zid, []).append(write.path)
        self._refused[sent] = self._work.now.seconds

    def _report_refused(self, zid: str) -> None:
        paths = self._unreported.pop(zid, [])
        if paths:
            self._work.log(
                logging.WARNING,
                f"{self._members.label(zid)} does not take {named(paths)}, which differs there"
                " from now on: the rules beside its keys may not allow it",
            )

    def _trim_refused(self) -> None:
        """Forget refused writes that have left the history."""
        for sent in list(self._refused):
            _, path, time, clock = sent
            write = self._store.history.find(path)
            if write is None or (write.time, write.clock) != (time, clock):
                del self._refused[sent]


def _split(writes: Iterable[Write]) -> list[list[Write]]:
    """Return writes grouped by the first part of their paths that differs."""
    every = list(writes)
    depth = len(common_path(write.path for write in every)) + 1
    parts: dict[Path, list[Write]] = {}
    for write in every:
        parts.setdefault(write.path[:depth], []).append(write)
    return list(parts.values())
