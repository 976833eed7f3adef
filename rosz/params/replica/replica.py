"""Copies of the parameter store: the replica of a process, and followers.

A replica first subscribes to the writes of others, then asks one of them for everything it has, and
serves others once it has that. Reads are look-ups in its own tree. A write is applied here and
broadcast to all others (`rosz.params.replica.broadcast`).
"""

from __future__ import annotations

import logging
import os
import random
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import PurePath
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Final, Self

import msgspec

from rosz.errors import ClosedError, DecodeError, NoReplica, ParamError
from rosz.lifecycle import Closable, Lifecycle
from rosz.params.paths import Path, joined, to_path
from rosz.params.replica.broadcast import WriteBroadcaster
from rosz.params.replica.members import Core
from rosz.params.replica.serve import ClientServer, ParameterKeys
from rosz.params.replica.state import NOT_A_PARAMETER, TreeReader, not_found
from rosz.params.replica.sync import AntiEntropy, Synchroniser
from rosz.params.replica.watch import TreeChange
from rosz.params.tree import MISSING
from rosz.params.values import normalise
from rosz.params.wire import Member, Record, SyncReply, decode, encode
from rosz.params.writes import DELETED, Change, Write
from rosz.session import Sample, Session, Stamp, clamp_timeout
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.params.replica.storage import Storage

__all__ = ("ACK_TIMEOUT", "NO_REPLICA", "Follower", "Outcome", "Replica", "process_label")

_log = logging.getLogger("rosz.params")

ACK_TIMEOUT: Final = 2.0
"""Time in seconds that a write waits for the other replicas by default."""

NO_REPLICA: Final = (
    "no process on this network holds the parameter store; start one that does, such as "
    "'rosz core', 'rosz launch …' or any node that uses parameters"
)

_ELDERS: Final = 3
"""Elders that there should be."""

_CHANCE: Final = 0.02
"""Chance that a replica becomes an elder in a second, if there is none; it grows each second."""

_GROWTH: Final = 4
_APPOINT_EVERY: Final = 10.0
"""Seconds in which a replica that was appointed becomes an elder, and all others are told."""

_ELDER: Final = "elder"
_READER: Final = "reader"
_WRITER: Final = "writer"
_MESH_TIMEOUT: Final = 2.0
_TOKENS_TIMEOUT: Final = 10.0
"""Seconds of the search for replicas; it takes milliseconds, or more while many start at once."""

_COMPARE_EVERY: Final = 5.0
_MAX_WAITING: Final = 2000
"""Tasks of a worker above which requests from the network are refused."""


class Outcome(msgspec.Struct, frozen=True):
    """The result of a write.

    Attributes:
        time: Time of the write, in nanoseconds since the epoch.
        slow: Replicas that did not acknowledge it in time, as shown to users.
    """

    time: int
    slow: tuple[str, ...] = ()


def process_label() -> str:
    """Return this process as shown to users: its program, process id and host."""
    program = PurePath(sys.argv[0]).name if sys.argv and sys.argv[0] else "python"
    # A file name may be other than UTF-8, but the label is sent to others.
    program = program.encode(errors="surrogateescape").decode(errors="replace")
    return f"{program} (pid {os.getpid()} on {socket.gethostname()})"


def _run(task: Callable[[], object]) -> None:
    try:
        task()
    except ClosedError as error:
        _log.debug("a task of the parameter store came too late: %s", error)


class _Copy(TreeReader):
    """A copy of the store: its state, the other replicas, and synchronisation with them.

    Args:
        session: Session of the copy; `close` leaves it open.
        domain: ROS domain.
    """

    def __init__(self, session: Session, domain: int) -> None:
        self._worker: Worker[Callable[[], object]] = Worker(
            "rosz-params", _run, capacity=_MAX_WAITING, logger=_log
        )
        self._core = Core(session, domain, self._worker)
        super().__init__(self._core.state)
        self._keys = self._core.keys
        self._members = self._core.members
        self._sync = Synchroniser(self._core)

    def close(self) -> None:
        """Leave the other copies; a second call has no effect."""
        self._members.close()
        self._worker.close()
        self._state.watchers.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Replica(_Copy):
    """The parameter store of one process. Safe for threads.

    The constructor joins the other replicas, which takes a few milliseconds, or up to seconds if
    those that should reply do not.

    Args:
        session: Session of the replica; `close` leaves it open.
        domain: ROS domain.
        label: Process as shown to users, in warnings and as the origin of its writes.
        settled: Event that is set when the session is linked to all its neighbours; without it, the
            constructor does not wait for that.
        storage: Storage that holds the parameters when the process has ended.
        handover: What the replica that this one replaces had; see `frozen`.

    Attributes:
        label: Process as shown to users.
        zid: Zenoh id of the session.

    Raises:
        ClosedError: The session is closed.
        TransportError: The session cannot declare the keys.
    """

    def __init__(
        self,
        session: Session,
        domain: int = 0,
        *,
        label: str = "",
        settled: threading.Event | None = None,
        storage: Storage | None = None,
        handover: bytes = b"",
    ) -> None:
        super().__init__(session, domain)
        self.label: str = label or process_label()
        self.zid: str = session.zid
        self._own = Member(session.stamp().time, session.zid, self.label)
        self._lifecycle = Lifecycle("the parameter store of this process", log=_log)
        self._storage = storage
        if self._restore(handover):
            self._compact()
        if storage is not None:
            self._state.on_new(storage.save)
        keys, sync = self._keys, self._sync
        self._broadcaster = WriteBroadcaster(self._core, storage, sync.compare_soon)
        self._parameter_keys = ParameterKeys(self._core)
        sync.merge = self._merge
        tell_key = keys.of(session.zid, "tell")
        self._declared: list[Closable] = [
            session.queryable(keys.of(session.zid, "sync"), sync.on_sync, complete=True),
            session.queryable(f"{tell_key}/**", sync.on_writes, complete=True),
            ClientServer(self._core, self.write, lambda: sync.ready),
        ]
        if settled is not None:
            settled.wait(_MESH_TIMEOUT)
        self._elder: Closable | None = None
        self._chance = _CHANCE
        self._appoint_at = 0.0
        self._members.follow(self._on_elder, self._on_member, _TOKENS_TIMEOUT)
        if keys.scoped or not self._members.elders():
            self._members.follow_all(_ELDER, _TOKENS_TIMEOUT)
        # Where rules may keep some replicas apart from others, all are elders.
        elder = keys.scoped or not self._members.elders()
        if not elder:
            self._members.unfollow_all(_ELDER)
        self._token = session.token(keys.token(self._own))
        self._join()
        if elder:
            self._become_elder()
        sync.on_appointed = self._become_elder
        AntiEntropy(self._is_oldest, sync, self._parameter_keys, self._compact, self._check_elders)

    def set(
        self, name: str | Path, value: object, *, origin: str = "", timeout: float = ACK_TIMEOUT
    ) -> Outcome:
        """Set a parameter; a dict replaces everything below the name.

        Args:
            name: Global name or its path.
            value: New value.
            origin: Writer, as shown to users; this process by default.
            timeout: Time limit in seconds of the wait for the other replicas.

        Raises:
            ParamError: A parameter cannot hold the value, the root would not be a dict, or a
                replica refuses the write or cannot store it.
            InvalidName: The name is not a global name.
            ClosedError: The replica or the session is closed.
        """
        path = to_path(name)
        return self.write([(path, normalise(value, joined(path)))], origin=origin, timeout=timeout)

    def delete(
        self, name: str | Path, *, origin: str = "", timeout: float = ACK_TIMEOUT
    ) -> Outcome:
        """Delete a parameter and everything below it; its parent stays, even if empty.

        Raises:
            ParamNotFound: The parameter is not set.
            ParamError: The parameter is the root, or a replica refuses the write or cannot
                store it.
            InvalidName: The name is not a global name.
            ClosedError: The replica or the session is closed.
        """
        path = to_path(name)
        if not path:
            raise ParamError("'/' cannot be deleted; set it to {} to delete all parameters")
        if self.lookup(path) is MISSING:
            raise not_found(self.root, path)
        return self.write([(path, DELETED)], origin=origin, timeout=timeout)

    def write(
        self,
        changes: Iterable[Change],
        *,
        origin: str = "",
        stamp: Stamp | None = None,
        timeout: float = ACK_TIMEOUT,
    ) -> Outcome:
        """Write a batch, which every replica applies as one change.

        Args:
            changes: Paths with normalised values or `DELETED`. If one path lies below another, the
                upper one comes first (`rosz.params.condense`).
            origin: Writer, as shown to users; this process by default.
            stamp: Stamp of the batch; a new one by default.
            timeout: Time limit in seconds of the wait for the other replicas.

        Raises:
            ParamError: The tree cannot hold a change, or a replica refuses the batch or cannot
                store it; nothing is changed then.
            DecodeError: The given stamp lies years ahead; nothing is changed then.
            ClosedError: The replica or the session is closed.
            UsageError: The timeout is not a number; nothing is changed then.
        """
        timeout = clamp_timeout(timeout)
        deadline = time.monotonic() + timeout
        if self._lifecycle.closing:
            self._lifecycle.check_open("write parameters")
        batch = list(changes)
        if not batch:
            return Outcome(0)
        if timeout > 0:
            self._members.follow_all(_WRITER, timeout)
            timeout = max(0.0, deadline - time.monotonic())
        origin = origin or self.label
        stamp, change = self._state.write(batch, origin, stamp)
        slow, refusals = self._broadcaster.send(batch, stamp, origin, timeout)
        unstored = self._wait_until_stored(deadline) if timeout > 0 else ""
        if unstored is None:
            slow = (*slow, f"the file of {self.label}")
        elif unstored:
            refusals[self.label] = unstored
        if refusals:
            self._undo(change, stamp, origin, deadline)
            raise _refused(batch, refusals)
        self._parameter_keys.publish(change)
        return Outcome(stamp.time, slow)

    def members(self) -> list[Member]:
        """Return the other replicas that are alive, oldest first, and follow all from now on."""
        self._members.follow_all(_READER, _TOKENS_TIMEOUT)
        return self._members.all()

    def compare(self, timeout: float) -> bool:
        """Compare with all other replicas and settle the differences.

        Args:
            timeout: Time limit in seconds.

        Returns:
            Whether all of them replied in time.
        """
        timeout = clamp_timeout(timeout)
        self._members.follow_all(_READER, timeout)
        results: SimpleQueue[bool] = SimpleQueue()
        expected = self._sync.compare_with_all(results.put)
        try:
            return all(results.get(timeout=timeout) for _ in range(expected))
        except Empty:
            return False

    def digest(self) -> bytes:
        """Return the digest of all writes; replicas with the same writes have the same digest."""
        with self._state as history:
            return history.digest()

    @contextmanager
    def frozen(self) -> Iterator[bytes]:
        """Return a context in which no write is taken or acknowledged here.

        It gets all writes, for the replica that replaces this one.
        """
        with self._state.frozen() as history:
            records = [Record.of(write) for write in history.writes()]
            yield encode(SyncReply(records=records, horizon=history.horizon))

    @property
    def closed(self) -> bool:
        """Whether the replica is closed, or being closed."""
        return self._lifecycle.closing

    def close(self) -> None:
        """Leave the other replicas; a second call has no effect."""
        self._lifecycle.close(self._leave)

    def _leave(self) -> None:
        self._token.close()
        if self._elder is not None:
            self._elder.close()
        for declared in self._declared:
            declared.close()
        self._broadcaster.close()
        super().close()
        self._parameter_keys.close()
        if self._storage is not None:
            self._storage.close()

    def __repr__(self) -> str:
        state = "closed" if self.closed else f"{len(self._members.zids)} others"
        return f"<Replica of {len(self._state)} writes, {state}>"

    def _join(self) -> None:
        known = self._members.zids
        if known:
            self._sync.join()
        else:
            self._state.restore(self._parameter_keys.load())
            self._sync.ready = True
        for member in self._members.elders():
            if member.zid not in known:
                self._on_elder(member, True)

    def _on_elder(self, member: Member, alive: bool) -> None:
        self._worker.submit(self._serve_parameter_keys)
        if alive and self._sync.ready:
            self._sync.compare_soon(member.zid)

    def _on_member(self, member: Member, alive: bool) -> None:
        if not alive:
            self._broadcaster.drop_peer(member.zid)
            self._sync.drop_peer(member.zid)
        elif self._sync.ready and member < self._own:
            self._sync.compare_soon(member.zid)

    def _check_elders(self) -> None:
        """Be an elder if there is none, and none any more if there are too many; appoint others."""
        elders = self._members.elders()
        if self._elder is not None:
            if not self._keys.scoped and sum(one < self._own for one in elders) >= _ELDERS:
                self._elder.close()
                self._elder = None
                self._members.unfollow_all(_ELDER)
            elif len(elders) < _ELDERS - 1 and self._is_oldest():
                self._appoint_elders(_ELDERS - 1 - len(elders))
        elif elders:
            self._chance = _CHANCE
        elif random.random() < self._chance:  # noqa: S311  # not for security
            self._become_elder()
        else:
            self._chance *= _GROWTH

    def _appoint_elders(self, count: int) -> None:
        """Let others become elders, who all see that there are too few, and not who else does."""
        now = time.monotonic()
        known = {one.zid for one in self._members.elders()} | self._core.session.out_of_reach()
        others = sorted(self._members.zids - known)
        if now >= self._appoint_at and others:
            self._appoint_at = now + _APPOINT_EVERY
            for zid in random.sample(others, min(count, len(others))):
                self._sync.appoint(zid)

    def _become_elder(self) -> None:
        if self._elder is not None:
            return
        self._members.follow_all(_ELDER)
        self._elder = self._core.session.token(self._keys.elder_token(self._own))
        if self._lifecycle.closing:  # perhaps too late for the thread that closes the replica
            self._elder.close()
        self._serve_parameter_keys()

    def _serve_parameter_keys(self) -> None:
        # Rules may keep replies of replicas on other machines away from this one.
        self._parameter_keys.serve(lambda: self._keys.scoped or self._is_oldest())

    def _is_oldest(self) -> bool:
        return self._elder is not None and all(
            self._own < elder for elder in self._members.elders()
        )

    def _restore(self, handover: bytes) -> bool:
        """Restore what is handed over or stored; return whether the storage differs from it."""
        if handover:
            reply = decode(handover, SyncReply)
            self._state.restore([record.write() for record in reply.records], reply.horizon)
            return True
        return self._storage is not None and self._state.restore(*self._storage.load())

    def _merge(self, writes: list[Write], horizon: int) -> None:
        self._state.merge(writes, horizon)
        self._compact()

    def _snapshot(self) -> tuple[list[Write], int]:
        with self._state as history:
            return list(history.writes()), history.horizon

    def _compact(self) -> None:
        if self._storage is not None:
            self._storage.compact(self._snapshot)

    def _wait_until_stored(self, deadline: float) -> str | None:
        """Return the reason why what was written cannot be stored; ``None`` if that takes long."""
        if self._storage is None:
            return ""
        reasons: SimpleQueue[str] = SimpleQueue()
        self._storage.when_stored(reasons.put)
        try:
            return reasons.get(timeout=max(0.0, deadline - time.monotonic()))
        except Empty:
            return None

    def _undo(self, change: TreeChange, stamp: Stamp, origin: str, deadline: float) -> None:
        """Undo a batch that a replica has refused, on all replicas that have taken it."""
        changes, now, undone = self._state.undo(change, stamp, origin)
        if changes:
            timeout = max(0.0, deadline - time.monotonic())
            self._broadcaster.send(changes, now, origin, timeout)
            self._parameter_keys.publish(undone)


def _ignore(_member: Member, _alive: bool) -> None: ...


def _refused(batch: list[Change], refusals: Mapping[str, str]) -> ParamError:
    name = joined(batch[0][0])
    more = f" and {len(batch) - 1} more" if len(batch) > 1 else ""
    reasons = "; ".join(f"{label} refuses it: {why}" for label, why in sorted(refusals.items()))
    return ParamError(f"'{name}'{more} is not written, since {reasons}")


class Follower(_Copy):
    """A copy of the store that only listens, for reading and watching; no write waits for it.

    Args:
        session: Session of the follower; `close` leaves it open.
        domain: ROS domain.
        timeout: Time limit in seconds of the search for replicas.

    Raises:
        NoReplica: There is no replica.
        ClosedError: The session is closed.
    """

    def __init__(self, session: Session, domain: int, timeout: float) -> None:
        super().__init__(session, domain)
        self._subscriber = session.subscriber(f"{self._keys.change}/**", self._on_change)
        try:
            self._members.follow(_ignore, self._on_member, timeout)
            if not self._members.zids:
                self._members.follow_all(_READER, timeout)
            self._join()
        except BaseException:
            self.close()
            raise
        self._worker.later(_COMPARE_EVERY, self._compare)

    def close(self) -> None:
        """Stop following; a second call has no effect."""
        self._subscriber.close()
        super().close()

    def _join(self) -> None:
        if not self._members.zids:
            raise NoReplica(NO_REPLICA)
        self._sync.join()

    def _on_member(self, member: Member, alive: bool) -> None:
        if not alive:
            self._sync.drop_peer(member.zid)

    def _on_change(self, sample: Sample) -> None:
        payload, key = sample.payload, sample.key
        # If the worker is busy, comparing finds the write.
        self._worker.offer(lambda: self._receive(payload, key))

    def _receive(self, payload: bytes, key: str) -> None:
        try:
            self._state.receive(payload, self._keys.change_reach(key))
        except DecodeError as error:
            self._state.damage.report(NOT_A_PARAMETER, error)

    def _compare(self) -> None:
        self._sync.compare_with_one()
        self._worker.later(_COMPARE_EVERY, self._compare)
