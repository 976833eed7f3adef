"""Two replicas finding out what differs between them, and settling it.

The asker sends its digest. Where the other's is the same, that is all. Otherwise the asker sends
the index of the buckets that differ; the other answers with the writes that the asker lacks and the
paths of those that it lacks itself, and the asker sends these. A replica that joins has nothing
yet, and gets everything with the first answer.

All of it is done on the replica's worker; what Zenoh calls only hands over to it.
"""

from __future__ import annotations

import logging
import random
import time
from collections.abc import Callable, Iterable
from functools import partial
from queue import Empty, SimpleQueue
from typing import Final

from rosz.errors import DecodeError, RoszError
from rosz.params.digest import Digest
from rosz.params.keys import Keys, Member, check_reach
from rosz.params.paths import Path, common
from rosz.params.replica.members import Members
from rosz.params.replica.refusals import Refusals
from rosz.params.replica.state import State
from rosz.params.replica.worker import Worker
from rosz.params.wire import (
    Index,
    Record,
    Sync,
    SyncAnswer,
    decode,
    encode,
    join_path,
    split_path,
)
from rosz.params.writes import DELETED, Write
from rosz.session import Query, Session

__all__ = ("Synchroniser",)

_log = logging.getLogger("rosz.params")

_NOTHING: Final = Digest().to_bytes()
_TIMEOUT: Final = 5.0
_PATIENCE: Final = 0.3
"""Seconds that a joining replica gives one other before it asks the next as well."""

_JOINED_BY: Final = 30.0
_TOLD_AFTER: Final = 5.0
"""Seconds after which who joins in vain says so: a hundred that start at once take their time."""
_SPREAD: Final = 0.05
"""Seconds over which replicas that find each other spread their questions, for each ten of them."""

_MOST_MET: Final = 8
"""Replicas to compare with of those that appear together, else many that start ask for ever."""


class Synchroniser:
    """Keeps one replica the same as the others.

    Args:
        session: The network.
        keys: Where to ask.
        state: What is kept the same.
        members: Whom to ask.
        worker: Where it is done.

    Attributes:
        ready: Whether this replica has what the others had when it came.
        busy: Those that it is comparing itself with.
        refusals: What others do not take.
    """

    def __init__(
        self, session: Session, keys: Keys, state: State, members: Members, worker: Worker
    ) -> None:
        self.ready = False
        self.session = session
        self.keys = keys
        self.state = state
        self.members = members
        self.worker = worker
        self.busy: set[str] = set()
        self.refusals = Refusals()
        self._met: set[str] = set()

    def join(self) -> None:
        """Get what the others have, from the first that has it and answers."""
        answers: SimpleQueue[bool] = SimpleQueue()
        asked: list[str] = []
        open_questions = 0
        began = time.monotonic()
        told = False
        while (passed := time.monotonic() - began) < _JOINED_BY:
            for member in self.members.all():
                if member.zid not in asked:
                    asked.append(member.zid)
                    self.worker.submit(partial(self._compare, member.zid, answers.put))
                    open_questions += 1
                    break
            if not open_questions:
                break
            try:
                if answers.get(timeout=_PATIENCE):
                    break
                open_questions -= 1
            except Empty:
                stopped = self.session.out_of_reach() >= self.members.zids
                if stopped or (passed > _TOLD_AFTER and not told):
                    told = True
                    self._complain(asked, passed)
                if stopped:
                    break
        else:
            self._complain(asked, _JOINED_BY)
        self.ready = True

    def _complain(self, asked: Iterable[str], seconds: float) -> None:
        labels = ", ".join(self.members.label(zid) for zid in asked)
        _log.warning("no replica of the parameters answered in %.2g s: %s", seconds, labels)

    def serve(self, query: Query) -> None:
        """Answer another replica."""
        payload = query.payload or b""
        if not self.worker.offer(lambda: self._answer(query, payload)):
            query.close()

    def serve_told(self, query: Query) -> None:
        """Take in what another replica has found this one to lack."""
        payload = query.payload or b""
        if not self.worker.offer(lambda: self._take(query, payload)):
            with query:
                query.reply_error("too much is told to this replica; tell it again later")

    def meet(self, member: Member) -> None:
        """Compare with a replica that has appeared, at a moment that not all choose alike.

        Of many that appear together, as behind a link that is back, some are enough: they have told
        each other what they know. What is missing even so is found by comparing now and then.
        """
        self.worker.submit(lambda: self._meet(member.zid))

    def gone(self, zid: str) -> None:
        """Begin anew with a replica if it comes back: it may have been out of reach."""
        self.worker.submit(lambda: self.refusals.forget(zid))

    def compare_with_one(self) -> None:
        """Compare with a replica chosen by chance."""
        zids = sorted(self.members.zids)
        self.worker.submit(lambda: self.refusals.trim(self.state))
        if zids:
            zid = random.choice(zids)  # noqa: S311  # nothing secret
            self.worker.submit(lambda: self._compare(zid))

    def compare_with_all(self, done: Callable[[bool], object]) -> int:
        """Compare with every replica; return how many times ``done`` will be called."""
        zids = sorted(self.members.zids)
        for zid in zids:
            self.worker.submit(partial(self._compare, zid, done))
        return len(zids)

    def _meet(self, zid: str) -> None:
        if not self._met:
            spread = _SPREAD * (1 + len(self.members.zids) / 10)
            delay = random.uniform(0, spread)  # noqa: S311  # nothing secret
            self.worker.later(delay, self._compare_with_met)
        self._met.add(zid)

    def _compare_with_met(self) -> None:
        met, self._met = sorted(self._met), set()
        for zid in random.sample(met, min(len(met), _MOST_MET)):
            self._compare(zid)

    def _compare(self, zid: str, done: Callable[[bool], object] = bool) -> None:
        if zid in self.busy:
            done(False)
            return
        self.busy.add(zid)
        _Comparison(self, zid, done).start()

    def _answer(self, query: Query, payload: bytes) -> None:
        with query:
            try:
                sync = decode(payload, Sync)
                answer = SyncAnswer(digest=self.state.digest(), ready=self.ready)
                if sync.digest == _NOTHING:
                    answer.records = [Record.of(write) for write in self.state.writes()]
                if sync.index is not None:
                    self._settle(sync.index, answer)
            except DecodeError as error:
                self.state.complaints.tell("a replica sent what is no comparison", error)
                query.reply_error(str(error))
                return
            query.reply(query.key, encode(answer))

    def _take(self, query: Query, payload: bytes) -> None:
        with query:
            try:
                reach = self.keys.reach(query.key, self.keys.tell(self.session.zid))
                writes = [record.write() for record in decode(payload, Sync).records]
                check_reach((write.path for write in writes), reach)
                self.state.apply(writes)
            except DecodeError as error:
                self.state.complaints.tell("a replica told what is no write", error)
                query.reply_error(str(error))
                return
            query.reply(query.key, encode(SyncAnswer(digest=self.state.digest())))

    def _settle(self, index: Index, answer: SyncAnswer) -> None:
        theirs = {path: (time_, clock) for path, time_, clock in index.entries}
        for write in self.state.bucket(index.buckets):
            known = theirs.get(join_path(write.path))
            if known is None or known < (write.time, write.clock):
                answer.records.append(Record.of(write))
        for path, (time_, clock) in theirs.items():
            if not self.state.hides(Write(split_path(path), time_, clock, DELETED)):
                answer.wanted.append(path)


class _Comparison:
    """One talk with one other replica, from its digest to the last write that was missing."""

    def __init__(self, owner: Synchroniser, zid: str, done: Callable[[bool], object]) -> None:
        self._owner = owner
        self._zid = zid
        self._done = done
        self._ready = False
        self._parts: list[list[Write]] = []

    def start(self) -> None:
        self._ask(Sync(digest=self._state.digest()), self._on_digest)

    @property
    def _state(self) -> State:
        return self._owner.state

    def _on_digest(self, answer: SyncAnswer) -> None:
        self._ready = answer.ready
        buckets = self._state.differing(answer.digest)
        if not buckets:
            self._end()
            return
        entries = [
            (join_path(write.path), write.time, write.clock)
            for write in self._state.bucket(buckets)
        ]
        self._ask(Sync(index=Index(buckets, entries)), self._on_index)

    def _on_index(self, answer: SyncAnswer) -> None:
        owner = self._owner
        found = [self._state.find(split_path(path)) for path in answer.wanted]
        lacking = [
            write
            for write in found
            if write is not None and not owner.refusals.rests(self._zid, write)
        ]
        if lacking:
            self._parts.append(lacking)
        self._tell_next()

    def _tell_next(self) -> None:
        if self._parts:
            self._tell(self._parts.pop())
        else:
            self._owner.refusals.report(self._zid, self._owner.members.label(self._zid))
            self._end()

    def _tell(self, writes: list[Write]) -> None:
        keys, worker = self._owner.keys, self._owner.worker
        taken: list[bool] = []
        try:
            self._owner.session.get_async(
                keys.reaching(keys.tell(self._zid), (write.path for write in writes)),
                lambda reply: taken.append(reply.ok),
                lambda: worker.submit(lambda: self._on_told(writes, taken)),
                payload=encode(Sync(records=[Record.of(write) for write in writes])),
                timeout=_TIMEOUT,
            )
        except RoszError:
            self._end(failed=True)
            raise

    def _on_told(self, writes: list[Write], taken: list[bool]) -> None:
        # Links that go leave questions without answers just as rules do.
        if False in taken or self._zid not in self._owner.members.zids:
            self._end(failed=True)
            return
        if not taken and self._owner.keys.scoped:
            # Rules judge by the path that all of a message lies below: parts of it may pass.
            if len(writes) > 1:
                self._parts += _parted(writes)
            else:
                self._owner.refusals.add(self._zid, writes[0])
        self._tell_next()

    def _ask(self, sync: Sync, then: Callable[[SyncAnswer], None]) -> None:
        answers: list[bytes] = []
        key = self._owner.keys.sync(self._zid)
        worker = self._owner.worker
        try:
            self._owner.session.get_async(
                key,
                lambda reply: answers.append(reply.payload) if reply.ok else None,
                lambda: worker.submit(lambda: self._on_answer(answers, then)),
                payload=encode(sync),
                timeout=_TIMEOUT,
            )
        except RoszError:
            self._end(failed=True)
            raise

    def _on_answer(self, answers: list[bytes], then: Callable[[SyncAnswer], None]) -> None:
        if not answers:
            self._end(failed=True)
            return
        try:
            answer = decode(answers[0], SyncAnswer)
            self._state.apply([record.write() for record in answer.records])
            then(answer)
        except DecodeError as error:
            label = self._owner.members.label(self._zid)
            self._state.complaints.tell(f"the replica in {label} answered nonsense", error)
            self._end(failed=True)

    def _end(self, *, failed: bool = False) -> None:
        self._owner.busy.discard(self._zid)
        self._done(self._ready and not failed)


def _parted(writes: list[Write]) -> list[list[Write]]:
    """Return writes by the part of their paths in which they begin to differ."""
    depth = len(common(write.path for write in writes)) + 1
    parts: dict[Path, list[Write]] = {}
    for write in writes:
        parts.setdefault(write.path[:depth], []).append(write)
    return list(parts.values())
