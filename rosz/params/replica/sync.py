"""Keeping replicas the same: joining, comparing with others, and anti-entropy.

The messages are those of `rosz.params.wire`. All of this runs on the replica's worker; Zenoh's
threads only hand over to it.
"""

from __future__ import annotations

import logging
import random
import threading
import time
from collections.abc import Callable, Iterable
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any, Final

from rosz.errors import DecodeError, RoszError
from rosz.params.history import EMPTY_DIGEST, History
from rosz.params.paths import Path, common_path, joined
from rosz.params.replica.members import Core, Members
from rosz.params.replica.serve import ParameterKeys
from rosz.params.replica.state import State
from rosz.params.wire import (
    Index,
    Keys,
    Record,
    SyncReply,
    SyncRequest,
    check_reach,
    decode,
    encode,
    join_path,
    split_path,
)
from rosz.params.writes import Write
from rosz.session import Query, Reply, Session
from rosz.worker import Worker, start_thread

__all__ = ("KEPT_TOMBSTONES", "AntiEntropy", "Synchroniser")

_log = logging.getLogger("rosz.params")

_DAMAGED_COMPARISON: Final = "a replica sent a damaged comparison"
_DAMAGED_WRITES: Final = "a replica sent damaged writes"
_TIMEOUT: Final = 5.0
_NEXT_AFTER: Final = 0.3
"""Seconds after which a joining replica asks the next replica as well; twice as many each time, as
many that start at once would else keep all others busy."""

_JOIN_TIMEOUT: Final = 30.0
_WARN_AFTER: Final = 5.0
"""Seconds after which a replica that cannot join warns; 100 that start at once need their time."""

_JOINING: Final = "joining"
_MORE_TIMEOUT: Final = 0.5
_SPREAD: Final = 0.05
"""Seconds over which those that find each other spread their requests."""

_MAX_COMPARED: Final = 8
"""Replicas to compare with, of those that appear together; with more, a large start never ends."""

_RETRY_REFUSED_AFTER: Final = 3600.0
"""Seconds before a refused write is sent again: the rules on the way may have changed."""

_TICK: Final = 1.0
_STOPPED: Final = 3.0
"""Delay of a tick in seconds that means that the process was stopped, and is not merely slow."""

_COMPARE_EVERY: Final = (10.0, 30.0)
_FORGET_EVERY: Final = 60.0
_RECONCILE_EVERY: Final = 30.0
KEPT_TOMBSTONES: Final = 10_000
"""The newest deletions, which are never forgotten; twice as many are remembered at most."""


class Synchroniser:
    """Keeps one replica the same as the others.

    Args:
        core: Core of the replica.

    Attributes:
        ready: Whether the replica has everything that the others had when it started.
        busy: Replicas that it is comparing itself with.
        refused: Writes that others refuse.
        merge: Function called with all writes and the horizon of another replica, to merge them.
        on_appointed: Function called when this replica has to become an elder.
    """

    def __init__(self, core: Core) -> None:
        self.ready: bool = False
        self.session: Session = core.session
        self.keys: Keys = core.keys
        self.state: State = core.state
        self.members: Members = core.members
        self.worker: Worker[Any] = core.worker
        self.busy: set[str] = set()
        self.refused: _RefusedWrites = _RefusedWrites()
        self.merge: Callable[[list[Write], int], object] = core.state.merge
        self.on_appointed: Callable[[], object] = bool
        self._appeared: set[str] = set()
        self._warned = False

    def join(self) -> None:
        """Get what the others have, from the first one that has joined and replies."""
        results: SimpleQueue[bool] = SimpleQueue()
        asked: list[str] = []
        open_requests = 0
        began = time.monotonic()
        while (passed := time.monotonic() - began) < _JOIN_TIMEOUT:
            zid = next((one.zid for one in self.members.all() if one.zid not in asked), "")
            if zid:
                asked.append(zid)
                self.worker.submit(partial(self._compare, zid, results.put))
                open_requests += 1
            elif not open_requests:
                if not self._find_more(asked):
                    break
                continue
            try:
                if results.get(timeout=min(_NEXT_AFTER * 2 ** (len(asked) - 1), _WARN_AFTER)):
                    break
                open_requests -= 1
            except Empty:
                if self._is_hopeless(asked, passed):
                    break
        else:
            self._warn(asked, _JOIN_TIMEOUT)
        self.members.unfollow_all(_JOINING)
        self.ready = True

    def _find_more(self, asked: list[str]) -> bool:
        """Look for replicas other than elders; return whether there are any to ask."""
        self.members.follow_all(_JOINING, _MORE_TIMEOUT)
        return not self.members.zids.issubset(asked)

    def _is_hopeless(self, asked: list[str], passed: float) -> bool:
        """Tell whether all replicas are stopped, and warn once when it takes long."""
        all_stopped = self.session.out_of_reach() >= self.members.zids
        if not (all_stopped or passed > _WARN_AFTER) or self._find_more(asked):
            return False
        if not self._warned:
            self._warned = True
            self._warn(asked, passed)
        return all_stopped

    def on_sync(self, query: Query) -> None:
        """Handle a request of another replica on the ``sync`` key."""
        payload = query.payload or b""
        respond = partial(self._compare_digests, payload)
        if not self.worker.offer(partial(self._handle, query, _DAMAGED_COMPARISON, respond)):
            query.close()

    def on_writes(self, query: Query) -> None:
        """Handle writes of another replica on the ``tell`` key."""
        payload = query.payload or b""
        respond = partial(self._receive, query.key, payload)
        if not self.worker.offer(partial(self._handle, query, _DAMAGED_WRITES, respond)):
            with query:
                query.reply_error("this replica has too many queries; send the writes again later")

    def compare_soon(self, zid: str) -> None:
        """Compare with a replica that has appeared or lagged, after a random delay.

        Of many that appear together, such as those behind a restored link, a few are enough:
        they have told each other what they know. Anti-entropy finds what is missing even so.
        """
        self.worker.submit(lambda: self._add_appeared(zid))

    def drop_peer(self, zid: str) -> None:
        """Forget what a replica refused: it may return, and was perhaps only out of reach."""
        self.worker.submit(lambda: self.refused.drop_peer(zid))

    def appoint(self, zid: str) -> None:
        """Compare with a replica, which becomes an elder."""
        self.worker.submit(partial(self._compare, zid, appoints=True))

    def compare_with_one(self) -> None:
        """Compare with a random elder, or with any replica if there is none."""
        zids = [member.zid for member in self.members.elders()] or sorted(self.members.zids)
        self.worker.submit(lambda: self.refused.trim(self.state))
        if zids:
            zid = random.choice(zids)  # noqa: S311  # not for security
            self.worker.submit(lambda: self._compare(zid))

    def compare_with_all(self, done: Callable[[bool], object]) -> int:
        """Compare with every replica.

        Args:
            done: Function called once for each replica, with whether it replied.

        Returns:
            The number of replicas.
        """
        zids = sorted(self.members.zids)
        for zid in zids:
            self.worker.submit(partial(self._compare, zid, done))
        return len(zids)

    def _warn(self, asked: Iterable[str], seconds: float) -> None:
        labels = ", ".join(self.members.label(zid) for zid in asked)
        _log.warning("no replica of the parameters answered in %.2g s: %s", seconds, labels)

    def _add_appeared(self, zid: str) -> None:
        if not self._appeared:
            delay = random.uniform(0, _SPREAD)  # noqa: S311  # not for security
            self.worker.later(delay, self._compare_with_appeared)
        self._appeared.add(zid)

    def _compare_with_appeared(self) -> None:
        zids, self._appeared = sorted(self._appeared), set()
        for zid in random.sample(zids, min(len(zids), _MAX_COMPARED)):
            self._compare(zid)

    def _compare(
        self, zid: str, done: Callable[[bool], object] = bool, *, appoints: bool = False
    ) -> None:
        if zid in self.busy:
            done(False)
            return
        self.busy.add(zid)
        _Comparison(self, zid, done).start(appoints=appoints)

    def _handle(self, query: Query, damage: str, respond: Callable[[], SyncReply]) -> None:
        with query:
            try:
                reply = respond()
            except DecodeError as error:
                self.state.damage.report(damage, error)
                query.reply_error(str(error))
                return
            query.reply(query.key, encode(reply))

    def _compare_digests(self, payload: bytes) -> SyncReply:
        request = decode(payload, SyncRequest)
        if request.appoints:
            self.on_appointed()
        found = None
        with self.state as history:
            digest, horizon = history.digest(), history.horizon
            if request.index is not None:
                found = history.compare(*request.index.content(), request.horizon)
            ahead = request.horizon < horizon or (found is not None and found.ahead)
            whole = ahead or request.digest == EMPTY_DIGEST
            writes = list(history.writes()) if whole else found.lacking if found else []
        if request.horizon > horizon or (found is not None and found.behind):
            self._merge_soon(request.sender)
        reply = SyncReply(digest, self.ready, whole=ahead, horizon=horizon)
        reply.records = [Record.of(write) for write in writes]
        reply.wanted = [join_path(path) for path in found.wanted] if found else []
        return reply

    def _merge_soon(self, zid: str) -> None:
        if zid in self.members.zids:
            self.worker.submit(partial(self._compare, zid))

    def _receive(self, key: str, payload: bytes) -> SyncReply:
        reach = self.keys.reach(key, self.keys.of(self.session.zid, "tell"))
        writes = [record.write() for record in decode(payload, SyncRequest).records]
        check_reach((write.path for write in writes), reach)
        self.state.apply(writes)
        with self.state as history:
            return SyncReply(digest=history.digest())


class _Comparison:
    """One exchange of differences with one replica, from the digest to the last missing write."""

    def __init__(self, owner: Synchroniser, zid: str, done: Callable[[bool], object]) -> None:
        self._owner = owner
        self._state = owner.state
        self._zid = zid
        self._done = done
        self._ready = False
        self._parts: list[list[Write]] = []

    def start(self, *, appoints: bool) -> None:
        with self._state as history:
            request = self._compose(history, digest=history.digest())
        request.appoints = appoints
        self._request(request, self._on_digest)

    def _compose(
        self, history: History, digest: bytes | None = None, index: Index | None = None
    ) -> SyncRequest:
        return SyncRequest(digest, index, [], history.horizon, self._owner.session.zid)

    def _on_digest(self, reply: SyncReply) -> None:
        self._ready = reply.ready
        with self._state as history:
            buckets = history.differing(reply.digest)
            writes = [write for bucket in buckets for write in history.bucket(bucket)]
            index = Index.of(buckets, writes)
            request = self._compose(history, index=index)
        if buckets:
            self._request(request, self._on_differences)
        else:
            self._end()

    def _on_differences(self, reply: SyncReply) -> None:
        with self._state as history:
            found = [history.find(split_path(path)) for path in reply.wanted]
        refused = self._owner.refused
        wanted = [
            write
            for write in found
            if write is not None and not refused.was_refused(self._zid, write)
        ]
        if wanted:
            self._parts.append(wanted)
        self._send_next()

    def _send_next(self) -> None:
        if self._parts:
            self._send(self._parts.pop())
        else:
            self._owner.refused.report(self._zid, self._owner.members.label(self._zid))
            self._end()

    def _send(self, writes: list[Write]) -> None:
        keys = self._owner.keys
        key = keys.scope(keys.of(self._zid, "tell"), (write.path for write in writes))
        request = SyncRequest(records=[Record.of(write) for write in writes])
        self._query(key, request, partial(self._on_sent, writes))

    def _on_sent(self, writes: list[Write], replies: list[Reply]) -> None:
        # A query stays without a reply if rules forbid it, or if the link is gone.
        if not all(reply.ok for reply in replies) or self._zid not in self._owner.members.zids:
            self._end(failed=True)
            return
        if not replies and self._owner.keys.scoped:
            # Rules judge by the common path of all writes in a message: parts of it may pass.
            if len(writes) > 1:
                self._parts += _split(writes)
            else:
                self._owner.refused.add(self._zid, writes[0])
        self._send_next()

    def _request(self, request: SyncRequest, then: Callable[[SyncReply], None]) -> None:
        key = self._owner.keys.of(self._zid, "sync")
        self._query(key, request, partial(self._on_reply, then))

    def _query(self, key: str, request: SyncRequest, then: Callable[[list[Reply]], None]) -> None:
        """Send a request, and call a function on the worker with the replies to it."""
        replies: list[Reply] = []
        done = partial(self._owner.worker.submit, partial(then, replies))
        try:
            self._owner.session.get_async(
                key, replies.append, done, payload=encode(request), timeout=_TIMEOUT
            )
        except RoszError:
            self._end(failed=True)
            raise

    def _on_reply(self, then: Callable[[SyncReply], None], replies: list[Reply]) -> None:
        payloads = [reply.payload for reply in replies if reply.ok]
        if not payloads:
            self._end(failed=True)
            return
        try:
            reply = decode(payloads[0], SyncReply)
            writes = [record.write() for record in reply.records]
            if reply.whole:
                self._owner.merge(writes, reply.horizon)
            else:
                self._state.apply(writes)
            then(reply)
        except DecodeError as error:
            label = self._owner.members.label(self._zid)
            self._state.damage.report(f"the replica in {label} sent a damaged reply", error)
            self._end(failed=True)

    def _end(self, *, failed: bool = False) -> None:
        self._owner.busy.discard(self._zid)
        self._done(self._ready and not failed)


def _split(writes: list[Write]) -> list[list[Write]]:
    """Return writes grouped by the first part of their paths that differs."""
    depth = len(common_path(write.path for write in writes)) + 1
    parts: dict[Path, list[Write]] = {}
    for write in writes:
        parts.setdefault(write.path[:depth], []).append(write)
    return list(parts.values())


class _RefusedWrites:
    """Writes that other replicas refuse, such as by the rules beside their keys.

    They are not sent again with every comparison. Not safe for threads.
    """

    def __init__(self) -> None:
        self._sent: dict[tuple[str, Path, int, str], float] = {}
        self._unreported: dict[str, list[Path]] = {}

    def was_refused(self, zid: str, write: Write) -> bool:
        """Tell whether a replica refused a write not long ago."""
        sent = self._sent.get((zid, write.path, write.time, write.clock))
        return sent is not None and time.monotonic() - sent < _RETRY_REFUSED_AFTER

    def add(self, zid: str, write: Write) -> None:
        """Remember that a replica refused a write."""
        key = (zid, write.path, write.time, write.clock)
        if key not in self._sent:
            self._unreported.setdefault(zid, []).append(write.path)
        self._sent[key] = time.monotonic()

    def report(self, zid: str, label: str) -> None:
        """Log what a replica refused for the first time.

        Args:
            zid: Session of the replica.
            label: Process of the replica, as shown to users.
        """
        paths = self._unreported.pop(zid, [])
        if paths:
            more = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
            _log.warning(
                "%s does not take '%s'%s, which differs there from now on: the rules beside its"
                " keys may not allow it",
                label,
                joined(paths[0]),
                more,
            )

    def drop_peer(self, zid: str) -> None:
        """Forget what a replica refused."""
        self._unreported.pop(zid, None)
        for key in [key for key in self._sent if key[0] == zid]:
            del self._sent[key]

    def trim(self, state: State) -> None:
        """Forget writes that have left the history."""
        with state as history:
            for key in list(self._sent):
                _, path, time_, clock = key
                write = history.find(path)
                if write is None or (write.time, write.clock) != (time_, clock):
                    del self._sent[key]


class AntiEntropy:
    """Compares with a random elder from time to time, and drops old tombstones.

    It also compares storages with the tree, in the oldest replica.

    Args:
        is_oldest: Function that tells whether this is the oldest replica.
        sync: Synchroniser of the replica.
        parameter_keys: Keys that storages hold.
        on_forgotten: Function called when tombstones were dropped.
        on_tick: Function called each second.
    """

    def __init__(
        self,
        is_oldest: Callable[[], bool],
        sync: Synchroniser,
        parameter_keys: ParameterKeys,
        on_forgotten: Callable[[], None],
        on_tick: Callable[[], None],
    ) -> None:
        self._is_oldest = is_oldest
        self._sync = sync
        self._parameter_keys = parameter_keys
        self._on_forgotten = on_forgotten
        self._on_tick = on_tick
        now = time.monotonic()
        self._last = now
        self._compare_at = now + random.uniform(*_COMPARE_EVERY)  # noqa: S311  # not for security
        self._forget_at = now + _FORGET_EVERY
        self._reconcile_at = now
        sync.worker.later(_TICK, self._tick)

    def _tick(self) -> None:
        self._sync.worker.later(_TICK, self._tick)
        now = time.monotonic()
        late = now - self._last - _TICK
        self._last = now
        self._on_tick()
        self._sync.state.apply_deferred()
        if late > _STOPPED or now >= self._compare_at:
            self._compare_at = now + random.uniform(*_COMPARE_EVERY)  # noqa: S311  # see above
            self._sync.compare_with_one()
        if now >= self._forget_at:
            self._forget_at = now + _FORGET_EVERY
            if self._sync.state.forget(KEPT_TOMBSTONES):
                self._on_forgotten()
        self._reconcile_storages(now)

    def _reconcile_storages(self, now: float) -> None:
        if not self._parameter_keys.subscribed:
            self._reconcile_at = now
        elif now >= self._reconcile_at and self._is_oldest():
            self._reconcile_at = now + _RECONCILE_EVERY
            # This waits for replies, which the worker must not.
            target = self._parameter_keys.reconcile
            start_thread(threading.Thread(target=target, name="rosz-params-mirror", daemon=True))
