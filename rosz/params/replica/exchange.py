"""Sending what the core of a copy of the store sends, and reporting to it what comes.

The keys and messages are those of `rosz.params.wire`.
"""

from __future__ import annotations

import itertools
import logging
import struct
import threading
from collections.abc import Callable
from functools import partial
from typing import Final

from rosz.errors import DecodeError, RoszError
from rosz.lifecycle import Closable
from rosz.params.replica.core import effects, events
from rosz.params.replica.core.store import NOT_A_PARAMETER
from rosz.params.replica.runner import CoreRunner, beat_until
from rosz.params.wire import (
    Departure,
    Keys,
    Purpose,
    SyncReply,
    SyncRequest,
    add_header,
    decode,
    encode,
    read_header,
)
from rosz.session import LONGEST_WAIT, Query, RawPublisher, Reply, Sample, Session
from rosz.worker import Worker

_log = logging.getLogger("rosz.params")

_LARGE: Final = 16_384
"""Bytes of a message above which the worker applies it, not the thread that receives it."""

_ACK: Final = struct.Struct("<Q")
_SEPARATOR: Final = b" "
_AT_WORK: Final = b"+"
_MOST_AT_WORK: Final = 8
"""Large batches whose progress is reported at once, each on a thread of its own."""
_MAX_WRITERS: Final = 100
"""Writers that are remembered, some with a publisher of their own for the acknowledgements to them;
when there are more, all are forgotten."""

_SENDERS: Final = 4
_MAX_UNSENT: Final = 100
"""Messages that wait for full links; the sizes of messages are not bounded."""

_MAX_UNRECEIVED: Final = 4096
"""Messages of others that wait; one that is dropped is not acknowledged, and so sent once more."""

_DAMAGED_QUERY: Final = "a replica sent a damaged query"
_DAMAGED_REPLY: Final = "a replica sent a damaged reply"
_BUSY: Final = "this replica has too many queries; send it again later"


def _send(task: Callable[[], object]) -> None:
    try:
        task()
    except RoszError as error:
        _log.debug("a message about parameters is not sent: %s", error)


class Exchange:
    """Sends and receives the messages of one copy of the store.

    Args:
        session: Session of the copy.
        keys: Keys of the domain.
        runner: The core that is run.
    """

    def __init__(self, session: Session, keys: Keys, runner: CoreRunner) -> None:
        self._session = session
        self._keys = keys
        self._runner = runner
        self._member = runner.core.config.member
        self._own = session.zid.encode()
        # A put blocks for seconds while the link to a replica that is stopped is full.
        self._senders: Worker[Callable[[], object]] = Worker(
            "rosz-params-send", _send, threads=_SENDERS, capacity=_MAX_UNSENT, logger=_log
        )
        self._ack_publishers: dict[str, RawPublisher | None] = {}
        self._publisher: RawPublisher | None = None
        self._queries: dict[int, Query] = {}
        self._at_work: dict[tuple[str, int], threading.Event] = {}
        self._numbers = itertools.count(1)
        self._lock = threading.RLock()
        self._declared: list[Closable] = []
        runner.handlers |= {
            effects.Publish: self._publish,
            effects.Resend: self._resend,
            effects.Acknowledge: self._acknowledge,
            effects.SendQuery: self._query,
            effects.Reply: self._reply,
            effects.FindStoppedPeers: lambda _: runner.run(
                events.StoppedPeersFound(frozenset(session.out_of_reach()))
            ),
        }

    def listen(self) -> None:
        """Receive batches from now on, without acknowledging them."""
        self._declared.append(
            self._session.subscriber(f"{self._keys.change}/**", self._on_sample_to_listener)
        )

    def serve(self) -> None:
        """Receive batches and queries of other replicas from now on."""
        session, keys = self._session, self._keys
        for key in (keys.change, f"{keys.scoped_change(session.zid)}/**"):
            self._declared.append(
                session.queue_subscriber(key, _MAX_UNRECEIVED, self._on_change, remote_only=True)
            )
        purposes: tuple[Purpose, ...] = ("write", "sync", "tell")
        for purpose in purposes:
            key = keys.of(session.zid, purpose) + ("" if purpose == "sync" else "/**")
            take = partial(self._on_query, purpose)
            self._declared.append(session.queryable(key, take, complete=True))

    def depart(self, kind: int) -> None:
        """Tell all others that this replica leaves, or restarts; a signal handler may do so."""
        stamp = self._session.stamp()
        notice = Departure(stamp.time, stamp.id, self._member.label, kind=kind)
        key = self._keys.scoped_change() if self._keys.scoped else self._keys.change
        _send(lambda: self._session.put(key, add_header(self._session.zid, 0, encode(notice))))

    def close(self) -> None:
        """Undeclare everything; a second call has no effect."""
        for declared in self._declared:
            declared.close()
        if self._publisher is not None:
            self._publisher.close()
        self._senders.close()
        self._close_ack_publishers()
        for at_work in list(self._at_work):
            self._end_work(*at_work)
        queries, self._queries = self._queries, {}
        for query in queries.values():
            query.close()

    # Batches of this replica

    def _publish(self, effect: effects.Publish) -> None:
        message = add_header(self._session.zid, effect.number, encode(effect.batch))
        put = partial(self._put, effect, message)
        if len(message) > _LARGE:
            put = partial(self._send_large, effect.number, put)
        elif not effect.patient:
            put()
            return
        # If the workers are busy, the replicas get the write when they compare.
        self._senders.offer(put)

    def _send_large(self, number: int, send: Callable[[], object]) -> None:
        """Send a large batch, and report all the while that it is being sent."""
        sent = threading.Event()
        beat_until(sent, lambda: self._runner.run(events.Progressed(number)))
        try:
            send()
        finally:
            sent.set()

    def _put(self, effect: effects.Publish, message: bytes) -> None:
        publisher = self._publisher or self._begin()
        scoped, large = self._keys.scoped, len(message) > _LARGE
        if scoped or large:
            key = self._keys.change
            if scoped:
                key = self._keys.scope(self._keys.scoped_change(), effect.paths)
            # Reports of progress must not wait behind a large batch.
            self._session.put(key, message, priority="background" if large else "normal")
        else:
            publisher.put(message)

    def _begin(self) -> RawPublisher:
        """Declare the keys of a replica that writes, as most never do."""
        with self._lock:
            if self._publisher is None:
                key = self._keys.ack(self._session.zid)
                self._declared.append(self._session.subscriber(key, self._on_ack, remote_only=True))
                self._publisher = self._session.publisher(self._keys.change, block=True)
            return self._publisher

    def _resend(self, effect: effects.Resend) -> None:
        message = add_header(self._session.zid, effect.number, encode(effect.batch))
        for zid in effect.zids:
            key = self._keys.scope(self._keys.of(zid, "write"), effect.paths)
            handle = partial(self._on_resend_reply, zid, effect.number)
            query = partial(self._session.get_async, key, handle, lambda: None, payload=message)
            if len(message) > _LARGE:  # a reply counts however late it comes
                query = partial(query, timeout=LONGEST_WAIT)
                self._senders.offer(partial(self._send_large, effect.number, query))
            else:
                self._senders.offer(partial(query, timeout=effect.timeout))

    def _on_resend_reply(self, zid: str, number: int, reply: Reply) -> None:
        if reply.ok:
            reason = reply.payload.decode(errors="replace")
            self._runner.run_soon(events.Acknowledged(zid, number, reason))

    def _on_ack(self, sample: Sample) -> None:
        payload = sample.payload
        who, _, reason = payload[_ACK.size :].partition(_SEPARATOR)
        zid = who.removeprefix(_AT_WORK)
        if zid.isalnum():
            number = _ACK.unpack_from(payload)[0]
            self._runner.run_soon(
                events.Acknowledged(zid.decode(), number, reason.decode(errors="replace"))
                if zid == who
                else events.Progressed(number, zid.decode())
            )

    # Batches of others

    def _on_change(self, sample: Sample) -> None:
        """Apply a message now if that is quick, else on the worker."""
        message = sample.payload
        try:
            reach = self._keys.change_reach(sample.key)
            if len(message) > _LARGE:
                sender, number, _ = read_header(message)
                receive = partial(self._receive_large, sender, number, message, sample.key)
                # If the worker is busy, it is not acknowledged, and so sent once more.
                self._begin_work(sender, number)
                if not self._runner.worker.offer(receive):
                    self._end_work(sender, number)
            elif deferred := self._runner.defer(message, reach):
                self._acknowledge(effects.Acknowledge(*deferred))
            else:
                event = self._runner.read_batch(message, reach)
                # A batch that is dropped is not acknowledged, so the sender repeats it.
                if isinstance(event, events.MemberLeft) or not self._runner.worker.full:
                    self._runner.run_soon(event)
        except DecodeError as error:
            self._runner.report(NOT_A_PARAMETER, error)
        except RoszError as error:
            _log.debug("a write is not acknowledged: %s", error)

    def _on_sample_to_listener(self, sample: Sample) -> None:
        # If the worker is busy, comparing finds the write.
        self._runner.worker.offer(partial(self._receive, sample.payload, sample.key))

    def _receive(self, message: bytes, key: str) -> bool:
        """Apply a message; return whether it was a batch."""
        try:
            self._runner.run(self._runner.read_batch(message, self._keys.change_reach(key)))
        except DecodeError as error:
            self._runner.report(NOT_A_PARAMETER, error)
            return False
        return True

    def _receive_large(self, sender: str, number: int, message: bytes, key: str) -> None:
        if not self._receive(message, key):
            self._end_work(sender, number)

    def _begin_work(self, sender: str, number: int) -> None:
        """Report to the writer of a large batch that this replica works on it, until it is done."""
        ended = threading.Event()
        is_free = len(self._at_work) < _MOST_AT_WORK
        if is_free and self._at_work.setdefault((sender, number), ended) is ended:
            key, note = self._keys.ack(sender), _ACK.pack(number) + _AT_WORK + self._own
            beat_until(ended, lambda: _send(lambda: self._session.put(key, note, block=False)))

    def _end_work(self, sender: str, number: int) -> None:
        ended = self._at_work.pop((sender, number), None)
        if ended is not None:
            ended.set()

    def _acknowledge(self, effect: effects.Acknowledge) -> None:
        if self._at_work:
            self._end_work(effect.sender, effect.number)
        if effect.query:
            query = self._queries.pop(effect.query, None)
            if query is not None:
                with query:
                    query.reply(query.key, effect.reason.encode())
            return
        ack = _ACK.pack(effect.number) + self._own
        if effect.reason:
            ack += _SEPARATOR + effect.reason.encode()
        publisher = self._ack_publishers.get(effect.sender)
        # On the thread that receives, an acknowledgement that waits for a full link would delay
        # the next messages. If it is lost, the writer sends the write again.
        if publisher is not None:
            publisher.put(ack)
        else:
            self._session.put(self._keys.ack(effect.sender), ack, block=False)
            self._runner.worker.submit(partial(self._open_ack_publisher, effect.sender))

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

    # Queries

    def _query(self, effect: effects.SendQuery) -> None:
        """Send a query, and report its end on the worker."""
        keys, paths = self._keys, effect.paths
        key = keys.of(effect.zid, "tell" if paths else "sync")
        if paths:
            key = keys.scope(key, paths)
        replies: list[Reply] = []
        ended = partial(self._on_replies, effect.number, replies)
        done = partial(self._runner.worker.submit, ended)
        try:
            self._session.get_async(
                key, replies.append, done, payload=encode(effect.request), timeout=effect.timeout
            )
        except RoszError:
            self._runner.worker.submit(
                partial(self._runner.run, events.QueryEnded(effect.number, None, failed=True))
            )
            raise

    def _on_replies(self, number: int, replies: list[Reply]) -> None:
        reply: SyncReply | None = None
        failed = not all(answer.ok for answer in replies)
        try:
            payloads = [answer.payload for answer in replies if answer.ok]
            if payloads:
                reply = decode(payloads[0], SyncReply)
        except DecodeError as error:
            self._runner.report(_DAMAGED_REPLY, error)
            failed = True
        self._runner.run(events.QueryEnded(number, reply, failed))

    def _on_query(self, purpose: Purpose, query: Query) -> None:
        if not self._runner.worker.offer(partial(self._handle, purpose, query)):
            with query:
                query.reply_error(_BUSY)

    def _handle(self, purpose: Purpose, query: Query) -> None:
        number = next(self._numbers)
        try:
            event = self._read_query(purpose, query, number)
        except DecodeError as error:
            self._runner.report(_DAMAGED_QUERY, error)
            with query:
                query.reply_error(str(error))
            return
        self._queries[number] = query
        self._runner.run(event)

    def _read_query(self, purpose: Purpose, query: Query, number: int) -> events.Event:
        message = query.payload or b""
        if purpose == "sync":
            return events.SyncReceived(number, decode(message, SyncRequest))
        reach = self._keys.reach(query.key, self._keys.of(self._session.zid, purpose))
        if purpose == "tell":
            return events.WritesReceived(number, decode(message, SyncRequest), reach)
        batch = self._runner.read_batch(message, reach, number)
        if isinstance(batch, events.MemberLeft):
            raise DecodeError("parameter batch", 0, "a departure, expected writes")
        if len(message) > _LARGE:
            self._begin_work(batch.sender, batch.number)
        return batch

    def _reply(self, effect: effects.Reply) -> None:
        query = self._queries.pop(effect.query, None)
        if query is not None:
            with query:
                if isinstance(effect.reply, str):
                    query.reply_error(effect.reply)
                else:
                    query.reply(query.key, encode(effect.reply))
