"""Copies of the parameter store: the replica of a process, and followers.

What a copy decides is up to its core (`rosz.params.replica.core`), which `runner` runs and
`exchange` connects with the others. Reads are look-ups in the copy's own tree.
"""

from __future__ import annotations

import logging
import os
import random
import socket
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import PurePath
from typing import TYPE_CHECKING, Final

from rosz.errors import ClosedError, NoReplica, ParamError, RoszError
from rosz.lifecycle import Closing, Lifecycle
from rosz.params.paths import Path, joined, to_path
from rosz.params.replica.core import Config, ReplicaCore
from rosz.params.replica.core.effects import Outcome, ReadStorages, SeedsChanged
from rosz.params.replica.core.events import (
    CloseCalled,
    CompareCalled,
    FollowCalled,
    JoinCalled,
    Loaded,
    StoragesRead,
    WriteCalled,
)
from rosz.params.replica.exchange import Exchange
from rosz.params.replica.reader import TreeReader, not_found
from rosz.params.replica.runner import CoreRunner
from rosz.params.replica.serve import ClientServer, ParameterKeys
from rosz.params.replica.tokens import Tokens
from rosz.params.tree import MISSING
from rosz.params.values import normalise
from rosz.params.wire import Departure, Keys, Record, ReplicaMember, SyncReply, decode, encode
from rosz.params.writes import DELETED, Change
from rosz.session import Session, Stamp, clamp_timeout
from rosz.worker import lend_thread

if TYPE_CHECKING:
    from rosz.params.replica.storage import Storage

_log = logging.getLogger("rosz.params")

ACK_TIMEOUT: Final = 2.0
"""Time in seconds that a write waits for the other replicas by default."""

NO_REPLICA: Final = (
    "no process on this network holds the parameter store; start one that does, such as "
    "'rosz core', 'rosz launch …' or any node that uses parameters"
)

_MESH_TIMEOUT: Final = 2.0
_TOKENS_TIMEOUT: Final = 10.0
"""Seconds of the search for replicas; it takes milliseconds, or more while many start at once."""

_TICK: Final = 1.0
_RECONCILE_EVERY: Final = 30.0


def process_label() -> str:
    """Return this process as shown to users: its program, process id and host."""
    program = PurePath(sys.argv[0]).name if sys.argv and sys.argv[0] else "python"
    # A file name may be other than UTF-8, but the label is sent to others.
    program = program.encode(errors="surrogateescape").decode(errors="replace")
    return f"{program} (pid {os.getpid()} on {socket.gethostname()})"


class _Copy(TreeReader, Closing):
    """A copy of the store: its core, and the messages that it exchanges with others."""

    def __init__(
        self, session: Session, domain: int, config: Config, storage: Storage | None = None
    ) -> None:
        self._runner = CoreRunner(ReplicaCore(config), session.clock, storage)
        super().__init__(self._runner)
        self._session = session
        self._keys = Keys(domain, scoped=session.secured)
        self._exchange = Exchange(session, self._keys, self._runner)
        self._tokens = Tokens(session, self._keys, self._runner)

    def close(self) -> None:
        """Leave the other copies; a second call has no effect."""
        self._tokens.close()
        self._exchange.close()
        self._runner.close()


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
        handover: All writes of the replica that this one replaces; see `frozen`.

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
        self.label: str = label or process_label()
        self.zid: str = session.zid
        member = ReplicaMember(session.stamp().time, session.zid, self.label)
        scoped, stored = session.secured, storage is not None
        config = Config(member, scoped, stored, seed=random.getrandbits(64))
        super().__init__(session, domain, config, storage)
        self._lifecycle = Lifecycle("the parameter store of this process", log=_log)
        self._storage = storage
        self._load(handover)
        self._parameter_keys = ParameterKeys(session, self._keys, self._runner)
        self._runner.on_own_change = self._parameter_keys.publish
        self._runner.handlers[ReadStorages] = self._read_storages
        self._runner.handlers[SeedsChanged] = self._serve_parameter_keys
        self._exchange.serve()
        self._server = ClientServer(session, self._keys, self._runner, self.write)
        if settled is not None:
            settled.wait(_MESH_TIMEOUT)
        self._tokens.follow_seeds(_TOKENS_TIMEOUT)
        self._runner.call(lambda call, _: JoinCalled(call))
        self._reconcile_at = time.monotonic()
        self._runner.worker.later(_TICK, self._tick)

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
            ParamError: A parameter cannot hold the value, or the root would not be a dict.
            PartlyWritten: A replica refuses the write or cannot store it; it stands.
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
            ParamError: The parameter is the root.
            PartlyWritten: A replica refuses the write or cannot store it; it stands.
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
        by_progress: bool = False,
    ) -> Outcome:
        """Write a batch, which every replica applies as one change.

        Args:
            changes: Paths with normalised values or `DELETED`. If one path lies below another, the
                upper one comes first (`rosz.params.condense`).
            origin: Writer, as shown to users; this process by default.
            stamp: Stamp of the batch; a new one by default.
            timeout: Time limit in seconds of the wait for the other replicas.
            by_progress: Whether the time counts from the last progress: the batch is being sent, or
                a replica works on it or has acknowledged it.

        Raises:
            ParamError: The tree cannot hold a change; nothing is changed then.
            PartlyWritten: A replica refuses the batch or cannot store it; it stands.
            DecodeError: The given stamp lies years ahead; nothing is changed then.
            ClosedError: The replica or the session is closed.
            UsageError: The timeout is not a number; nothing is changed then.
        """
        timeout = clamp_timeout(timeout)
        if self._lifecycle.closing:
            self._lifecycle.check_open("write parameters")
        batch = list(changes)
        if not batch:
            return Outcome(0)
        origin = origin or self.label
        given = None if stamp is None else (stamp.time, stamp.id)
        is_given = given is not None
        outcome: Outcome = self._runner.call(
            lambda call, now: WriteCalled(
                call, batch, origin, given or (now.time, now.id), is_given, timeout, by_progress
            )
        )
        return outcome

    def members(self) -> list[ReplicaMember]:
        """Return the other replicas that are alive, oldest first, and follow all from now on."""
        self._runner.call(lambda call, _: FollowCalled(call, _TOKENS_TIMEOUT))
        return self._runner.core.members()

    def compare(self, timeout: float) -> bool:
        """Compare with all other replicas and settle the differences.

        Args:
            timeout: Time limit in seconds.

        Returns:
            Whether all of them replied in time.
        """
        timeout = clamp_timeout(timeout)
        good: bool = self._runner.call(lambda call, _: CompareCalled(call, timeout))
        return good

    def digest(self) -> bytes:
        """Return the digest of all writes; replicas with the same writes have the same digest."""
        with self._runner as history:
            return history.digest()

    @contextmanager
    def frozen(self) -> Iterator[bytes]:
        """Return a context in which no write is taken or acknowledged here.

        It gets all writes, for the replica that replaces this one, which others wait for.
        """
        self._exchange.depart(Departure.RESTARTS)
        with self._runner.frozen() as history:
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
        try:
            self._runner.call(lambda call, _: CloseCalled(call))
        except RoszError as error:  # below a signal handler that interrupted a write
            _log.debug("nothing is handed over: %s", error)
        self._exchange.depart(Departure.LEAVES)
        self._server.close()
        super().close()
        self._parameter_keys.close()
        if self._storage is not None:
            self._storage.close()

    def __repr__(self) -> str:
        state = "closed" if self.closed else f"{len(self._runner.core.zids)} others"
        return f"<Replica of {len(self._runner)} writes, {state}>"

    def _load(self, handover: bytes) -> None:
        """Load the writes of before."""
        if handover:
            reply = decode(handover, SyncReply)
            writes = [record.write() for record in reply.records]
            self._runner.run(Loaded(writes, reply.horizon, changed=True))
        elif self._storage is not None:
            self._runner.run(Loaded(*self._storage.load()))

    def _read_storages(self, _: ReadStorages) -> None:
        def read() -> None:
            self._runner.run(StoragesRead(self._parameter_keys.load()))

        if not lend_thread(read):
            read()

    def _serve_parameter_keys(self, _: SeedsChanged) -> None:
        # Rules may keep replies of replicas on other machines away from this one.
        scoped, core = self._keys.scoped, self._runner.core
        serve = self._parameter_keys.serve
        self._runner.worker.submit(lambda: serve(lambda: scoped or core.is_oldest_seed))

    def _tick(self) -> None:
        """Compare other programs' storages with the tree from time to time, if this is to do so."""
        self._runner.worker.later(_TICK, self._tick)
        self._runner.apply_deferred()
        now = time.monotonic()
        if not self._parameter_keys.subscribed:
            self._reconcile_at = now
        elif now >= self._reconcile_at and self._runner.core.is_oldest_seed:
            self._reconcile_at = now + _RECONCILE_EVERY
            lend_thread(self._reconcile)  # it waits for replies, which the worker must not

    def _reconcile(self) -> None:
        with suppress(ClosedError):  # the session may close meanwhile
            self._parameter_keys.reconcile()


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
        member = ReplicaMember(session.stamp().time, session.zid, "")
        super().__init__(session, domain, Config(member, session.secured, listens=True))
        self._exchange.listen()
        try:
            self._tokens.follow_seeds(timeout)
            joined_others = self._runner.call(lambda call, _: JoinCalled(call))
        except BaseException:
            self.close()
            raise
        if not joined_others:
            self.close()
            raise NoReplica(NO_REPLICA)
