"""Broadcasting writes to all replicas, and the acknowledgements that tell when they have them.

A write is acknowledged, and `WriteBroadcaster.send` returns, when every live replica has applied
it. A replica that has not acknowledged it after a moment is sent it once more, as a query to it
alone. One that still does not answer in time is lagging: no write waits for it until it answers
again, but each names it. One that refuses the write, or cannot store it, acknowledges it with the
reason.
"""

from __future__ import annotations

import itertools
import logging
import struct
import threading
import time
from collections.abc import Callable, Collection
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

from rosz.errors import DecodeError, RoszError
from rosz.lifecycle import Closable
from rosz.params.paths import Path, joined
from rosz.params.replica.members import Core
from rosz.params.replica.state import NOT_A_PARAMETER
from rosz.params.wire import Batch, add_header, encode, read_header
from rosz.params.writes import Change
from rosz.session import Query, RawPublisher, Reply, Sample, Stamp
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.params.replica.storage import Storage

__all__ = ("Delivery", "PendingWrite", "PendingWrites", "WriteBroadcaster")

_log = logging.getLogger("rosz.params")

_LARGE: Final = 16_384
"""Bytes of a message above which it is not applied on Zenoh's thread."""

_ACK: Final = struct.Struct("<Q")
_SEPARATOR: Final = b" "
_MAX_WRITERS: Final = 100
"""Writers that are remembered, some with a publisher of their own for the acknowledgements to them;
when there are more, all are forgotten."""

_SENDERS: Final = 4
_MAX_UNSENT: Final = 100
"""Messages that wait for full links; the sizes of messages are not bounded."""

_RESEND_AFTER: Final = 0.25
"""Seconds after which a write is sent once more to those that have not acknowledged it."""


_NOBODY: Final[frozenset[str]] = frozenset()


class Delivery(NamedTuple):
    """How a write arrived.

    Attributes:
        slow: Replicas that have not acknowledged it, as shown to users.
        refusals: Replicas that refused it, as shown to users, and their reasons.
    """

    slow: tuple[str, ...]
    refusals: dict[str, str]


class PendingWrite:
    """One write that is not yet acknowledged by all.

    Attributes:
        number: Number of the write of this replica.
        waiting: Sessions that have not acknowledged it.
        skipped: Sessions that lag, which it does not wait for.
        refusals: Reason of each session that has refused it.
    """

    __slots__ = ("_done", "number", "refusals", "skipped", "waiting")

    def __init__(self, number: int, waiting: set[str], skipped: frozenset[str]) -> None:
        self.number: int = number
        self.waiting: set[str] = waiting
        self.skipped: frozenset[str] = skipped
        self.refusals: dict[str, str] = {}
        # A bare lock is the fastest thing to wait on: it is acquired here and released at the end.
        self._done = threading.Lock()
        if waiting:
            self._done.acquire()

    def wait(self, seconds: float) -> bool:
        """Wait until all have acknowledged the write; return whether they have."""
        return self._done.acquire(timeout=max(0.0, seconds)) if self.waiting else True

    def remove(self, zid: str) -> None:
        """Stop waiting for a session."""
        if zid in self.waiting:
            self.waiting.discard(zid)
            if not self.waiting:
                self._done.release()


class PendingWrites:
    """All writes of this replica that are not yet acknowledged by all.

    Safe for threads, and for a signal handler that writes.

    Args:
        on_return: Function called with a session that lagged when it acknowledges a write again; it
            may lack others.
    """

    def __init__(self, on_return: Callable[[str], object]) -> None:
        self._on_return = on_return
        self._numbers = itertools.count(1)
        self._pending: dict[int, PendingWrite] = {}
        self._lagging: set[str] = set()
        self._lock = threading.RLock()

    def open(self, zids: Collection[str]) -> PendingWrite:
        """Start waiting for sessions, except for lagging ones."""
        with self._lock:
            skipped = self._lagging.intersection(zids) if self._lagging else _NOBODY
            waiting = set(zids).difference(skipped)
            pending = PendingWrite(next(self._numbers), waiting, frozenset(skipped))
            if waiting:
                self._pending[pending.number] = pending
            return pending

    def close(self, pending: PendingWrite) -> frozenset[str]:
        """Stop waiting; return the sessions that did not acknowledge, which are lagging now."""
        with self._lock:
            self._pending.pop(pending.number, None)
            late = frozenset(pending.waiting)
            self._lagging |= late
            return late

    @property
    def any_lagging(self) -> bool:
        """Whether any session lags."""
        return bool(self._lagging)

    def lagging(self, pending: PendingWrite) -> frozenset[str]:
        """Return the sessions that a write did not wait for, and that lag still."""
        return pending.skipped & self._lagging if pending.skipped else _NOBODY

    def acknowledge(self, zid: str, number: int, refusal: str = "") -> None:
        """Handle an acknowledgement.

        Args:
            zid: Session that has acknowledged a write.
            number: Number of the write.
            refusal: Reason why the session refused it; empty if it has taken it.
        """
        with self._lock:
            if zid in self._lagging:
                self._lagging.discard(zid)
                self._on_return(zid)
            pending = self._pending.get(number)
            if pending is not None:
                if refusal:
                    pending.refusals[zid] = refusal
                pending.remove(zid)

    def drop_peer(self, zid: str) -> None:
        """Stop waiting for a session that is gone."""
        with self._lock:
            self._lagging.discard(zid)
            for pending in self._pending.values():
                pending.remove(zid)

    def abandon(self) -> None:
        """Stop waiting for all sessions."""
        with self._lock:
            for pending in self._pending.values():
                for zid in tuple(pending.waiting):
                    pending.remove(zid)


class WriteBroadcaster:
    """Sends the writes of one replica, and receives and acknowledges those of others.

    Args:
        core: Core of the replica.
        storage: Storage; with it, a write is acknowledged when it is stored.
        on_return: Function called with a session that lagged and acknowledges writes again.

    Attributes:
        pending: Writes that are not yet acknowledged by all.
    """

    def __init__(
        self, core: Core, storage: Storage | None, on_return: Callable[[str], object]
    ) -> None:
        self.pending: PendingWrites = PendingWrites(on_return)
        self._session = session = core.session
        self._keys = keys = core.keys
        self._state = core.state
        self._members = core.members
        self._worker = core.worker
        self._storage = storage
        self._own = session.zid.encode()
        # A put blocks for seconds while the link to a replica that is stopped is full.
        self._senders: Worker[Callable[[], object]] = Worker(
            "rosz-params-send", _send, threads=_SENDERS, capacity=_MAX_UNSENT, logger=_log
        )
        self._ack_publishers: dict[str, RawPublisher | None] = {}
        self._publisher: RawPublisher | None = None
        self._lock = threading.RLock()
        resent_key = keys.of(session.zid, "write")
        self._declared: list[Closable] = [
            session.subscriber(key, self._on_change, remote_only=True, rare=True)
            for key in (keys.change, f"{keys.scoped_change(session.zid)}/**")
        ]
        self._declared += [
            session.queryable(f"{resent_key}/**", self._on_resent, complete=True),
        ]

    def send(self, changes: list[Change], stamp: Stamp, origin: str, timeout: float) -> Delivery:
        """Send a batch to all replicas, and wait until they have acknowledged it.

        Args:
            changes: Batch; of two changes, the deeper one comes later.
            stamp: Stamp of the batch.
            origin: Writer, as shown to users.
            timeout: Time limit in seconds; 0 does not wait.

        Raises:
            ClosedError: The session is closed.
            TransportError: The session cannot send.
        """
        began = time.monotonic()
        deadline = began + timeout
        pending = self.pending.open(self._members.zids if timeout > 0 else ())
        for zid in pending.waiting - self._members.zids:  # gone since the set was read
            self.pending.drop_peer(zid)
        try:
            batch = Batch.of((stamp.time, stamp.id), origin, changes)
            message = add_header(self._session.zid, pending.number, encode(batch))
            self._publish(changes, message)
            if not pending.wait(min(_RESEND_AFTER, timeout)) and not self._all_stopped(pending):
                self._resend(pending, changes, message, deadline - time.monotonic())
                pending.wait(deadline - time.monotonic())
        finally:
            late = self._labels(self.pending.close(pending))
        if late:
            _warn(changes, late, time.monotonic() - began)
        late += self._labels(self.pending.lagging(pending) & self._members.zids)
        refusals = {self._members.label(zid): why for zid, why in pending.refusals.items()}
        return Delivery(tuple(late), refusals)

    def drop_peer(self, zid: str) -> None:
        """Stop waiting for a replica that is gone."""
        self.pending.drop_peer(zid)

    def close(self) -> None:
        """Undeclare everything, and stop waiting for all replicas."""
        for declared in self._declared:
            declared.close()
        self.pending.abandon()
        self._senders.close()
        self._close_ack_publishers()
        if self._publisher is not None:
            self._publisher.close()

    def _begin(self) -> RawPublisher:
        """Declare what a replica needs that writes, as most never do."""
        with self._lock:
            if self._publisher is None:
                key = self._keys.ack(self._session.zid)
                self._declared.append(self._session.subscriber(key, self._on_ack, remote_only=True))
                self._publisher = self._session.publisher(self._keys.change, block=True)
            return self._publisher

    def _publish(self, changes: list[Change], message: bytes) -> None:
        if len(message) <= _LARGE and not self.pending.any_lagging:
            self._put(changes, message)
        else:
            # If the workers are busy, the replicas get the write when they compare.
            self._senders.offer(lambda: self._put(changes, message))

    def _put(self, changes: list[Change], message: bytes) -> None:
        publisher = self._publisher or self._begin()
        if self._keys.scoped:
            key = self._keys.scope(self._keys.scoped_change(), (path for path, _ in changes))
            self._session.put(key, message)
        else:
            publisher.put(message)

    def _all_stopped(self, pending: PendingWrite) -> bool:
        """Tell whether all sessions waited for are stopped; they get the write when they resume."""
        return self._session.out_of_reach().issuperset(pending.waiting.copy())

    def _labels(self, late: Collection[str]) -> list[str]:
        stopped = self._session.out_of_reach() if late else ()
        return sorted(self._members.label(zid) + " (stopped)" * (zid in stopped) for zid in late)

    def _resend(
        self, pending: PendingWrite, changes: list[Change], message: bytes, timeout: float
    ) -> None:
        if timeout <= 0:
            return
        for zid in sorted(pending.waiting.copy()):
            key = self._keys.scope(self._keys.of(zid, "write"), (path for path, _ in changes))
            handle = partial(self._on_resend_reply, zid, pending.number)
            query = partial(self._session.get_async, key, handle, _ignore)
            self._senders.offer(partial(query, payload=message, timeout=timeout))

    def _on_resend_reply(self, zid: str, number: int, reply: Reply) -> None:
        if reply.ok:
            self.pending.acknowledge(zid, number, reply.payload.decode(errors="replace"))

    def _on_change(self, sample: Sample) -> None:
        """Apply a message on Zenoh's thread if that is quick, else on the worker."""
        message = sample.payload
        try:
            reach = self._keys.change_reach(sample.key)
            sender, number, _ = read_header(message)
        except DecodeError as error:
            self._state.damage.report(NOT_A_PARAMETER, error)
            return
        acknowledge = partial(self._acknowledge, sender, number)
        if len(message) <= _LARGE:
            if self._state.defer(message, reach):
                acknowledge()
                return
            refusal = self._state.try_receive(message, reach)
            if refusal is not None:
                self._when_stored(refusal, acknowledge)
                return
        # If the worker is busy, the write is not acknowledged, and so sent once more.
        self._worker.offer(lambda: self._apply(message, reach, acknowledge))

    def _apply(self, message: bytes, reach: Path, then: Callable[[str], object]) -> None:
        self._when_stored(self._state.receive(message, reach), then)

    def _when_stored(self, refusal: str, then: Callable[[str], object]) -> None:
        """Call a function when everything applied so far is stored, or is not.

        Args:
            refusal: Reason why the message was not applied; empty if it was.
            then: Function called with the reason, or with the reason why it is not stored.
        """
        if refusal or self._storage is None:
            then(refusal)
        else:
            self._storage.when_stored(then)

    def _acknowledge(self, sender: str, number: int, refusal: str = "") -> None:
        ack = _ACK.pack(number) + self._own
        if refusal:
            ack += _SEPARATOR + refusal.encode()
        publisher = self._ack_publishers.get(sender)
        try:
            # On Zenoh's thread: an acknowledgement that waits for a full link would delay the
            # samples that arrive. If it is lost, the writer sends the write again.
            if publisher is not None:
                publisher.put(ack)
            else:
                self._session.put(self._keys.ack(sender), ack, block=False)
                self._worker.submit(lambda: self._open_ack_publisher(sender))
        except RoszError as error:
            _log.debug("a write is not acknowledged: %s", error)

    def _open_ack_publisher(self, sender: str) -> None:
        """Declare the key of acknowledgements to a writer, which makes each put faster.

        That is worth it from the second write on.
        """
        if sender not in self._ack_publishers:
            if len(self._ack_publishers) >= _MAX_WRITERS:
                self._close_ack_publishers()
            self._ack_publishers[sender] = None
        elif self._ack_publishers[sender] is None:
            self._ack_publishers[sender] = self._session.publisher(self._keys.ack(sender))

    def _close_ack_publishers(self) -> None:
        publishers, self._ack_publishers = self._ack_publishers, {}
        for publisher in publishers.values():
            if publisher is not None:
                publisher.close()

    def _on_ack(self, sample: Sample) -> None:
        payload = sample.payload
        zid, _, refusal = payload[_ACK.size :].partition(_SEPARATOR)
        if zid.isalnum():
            number = _ACK.unpack_from(payload)[0]
            self.pending.acknowledge(zid.decode(), number, refusal.decode(errors="replace"))

    def _on_resent(self, query: Query) -> None:
        message = query.payload or b""
        try:
            reach = self._keys.reach(query.key, self._keys.of(self._session.zid, "write"))
        except DecodeError as error:
            with query:
                query.reply_error(str(error))
            return
        confirm = partial(_confirm, query)
        if not self._worker.offer(lambda: self._apply(message, reach, confirm)):
            query.close()


def _send(task: Callable[[], object]) -> None:
    try:
        task()
    except RoszError as error:
        _log.debug("a write is not sent: %s", error)  # whoever lacks it is named as slow


def _ignore() -> None: ...


def _confirm(query: Query, refusal: str) -> None:
    with query:
        query.reply(query.key, refusal.encode())


def _warn(changes: list[Change], late: list[str], seconds: float) -> None:
    more = f" and {len(changes) - 1} more" if len(changes) > 1 else ""
    _log.warning(
        "'%s'%s is written, but not yet known to %s, which did not answer within %.2g s",
        joined(changes[0][0]) if changes else "/",
        more,
        ", ".join(late),
        seconds,
    )
