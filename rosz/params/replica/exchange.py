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
from typing import Any, Final

from rosz.errors import DecodeError, RoszError
from rosz.lifecycle import Closable
from rosz.params.replica.core import effects, events
from rosz.params.replica.core.store import NOT_A_PARAMETER
from rosz.params.replica.runner import CoreRunner
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
from rosz.session import Query, RawPublisher, Reply, Sample, Session
from rosz.worker import Worker

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
        self._numbers = itertools.count(1)
        self._lock = threading.RLock()
        self._declared: list[Closable] = []
        self._here: dict[type[effects.Effect], Callable[[Any], object]] = {
            effects.Publish: self._publish,
            effects.Resend: self._resend,
            effects.Acknowledge: self._acknowledge,
            effects.SendQuery: self._query,
            effects.Reply: self._reply,
            effects.FindStopped: self._find_stopped,
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
                session.subscriber(key, self._on_change, remote_only=True, rare=True)
            )
        purposes: tuple[tuple[Purpose, Callable[[Query], None]], ...] = (
            ("write", self._on_resent),
            ("sync", self._on_sync),
            ("tell", self._on_writes),
        )
        for purpose, handle in purposes:
            key = keys.of(session.zid, purpose) + ("" if purpose == "sync" else "/**")
            take = partial(self._on_query, handle)
            self._declared.append(session.queryable(key, take, complete=True))

    def carry_out(self, effect: effects.Effect) -> None:
        """Carry out an effect; sending much takes place in the background."""
        handle = self._here.get(type(effect))
        if handle is not None:
            try:
                handle(effect)
            except RoszError as error:
                _log.debug("%s is not done: %s", type(effect).__name__, error)

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
        queries, self._queries = self._queries, {}
        for query in queries.values():
            query.close()

    def _find_stopped(self, _: effects.FindStopped) -> None:
        self._runner.run(events.StoppedFound(frozenset(self._session.out_of_reach())))

    # Batches of this replica

    def _publish(self, effect: effects.Publish) -> None:
        message = add_header(self._session.zid, effect.number, encode(effect.batch))
        put = partial(self._put, effect, message)
        if len(message) <= _LARGE and not effect.patient:
            put()
        else:
            # If the workers are busy, the replicas get the write when they compare.
            self._senders.offer(put)

    def _put(self, effect: effects.Publish, message: bytes) -> None:
        publisher = self._publisher or self._begin()
        if self._keys.scoped:
            key = self._keys.scope(self._keys.scoped_change(), effect.paths)
            self._session.put(key, message)
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
            query = partial(self._session.get_async, key, handle, lambda: None)
            self._senders.offer(partial(query, payload=message, timeout=effect.timeout))

    def _on_resend_reply(self, zid: str, number: int, reply: Reply) -> None:
        if reply.ok:
            reason = reply.payload.decode(errors="replace")
            self._runner.run_soon(events.Acknowledged(zid, number, reason))

    def _on_ack(self, sample: Sample) -> None:
        payload = sample.payload
        zid, _, reason = payload[_ACK.size :].partition(_SEPARATOR)
        if zid.isalnum():
            number = _ACK.unpack_from(payload)[0]
            self._runner.run_soon(
                events.Acknowledged(zid.decode(), number, reason.decode(errors="replace"))
            )

    # Batches of others

    def _on_change(self, sample: Sample) -> None:
        """Apply a message on Zenoh's thread if that is quick, else on the worker."""
        message = sample.payload
        try:
            reach = self._keys.change_reach(sample.key)
            sender, number, _ = read_header(message)
            if len(message) > _LARGE:
                # If the worker is busy, it is not acknowledged, and so sent once more.
                self._runner.worker.offer(partial(self._receive, message, sample.key))
            elif self._runner.defer(message, reach):
                self._acknowledge(effects.Acknowledge(sender, number))
            else:
                self._runner.receive(message, reach)
        except DecodeError as error:
            self._runner.report(NOT_A_PARAMETER, error)
        except RoszError as error:
            _log.debug("a write is not acknowledged: %s", error)

    def _on_sample_to_listener(self, sample: Sample) -> None:
        message, key = sample.payload, sample.key
        # If the worker is busy, comparing finds the write.
        self._runner.worker.offer(partial(self._receive, message, key))

    def _receive(self, message: bytes, key: str) -> None:
        try:
            self._runner.run(self._runner.read_batch(message, self._keys.change_reach(key)))
        except DecodeError as error:
            self._runner.report(NOT_A_PARAMETER, error)

    def _acknowledge(self, effect: effects.Acknowledge) -> None:
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
        # On Zenoh's thread: an acknowledgement that waits for a full link would delay the
        # samples that arrive. If it is lost, the writer sends the write again.
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
                key,
                replies.append,
                done,
                payload=encode(effect.request),
                timeout=effect.timeout,
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

    def _on_query(self, handle: Callable[[Query], None], query: Query) -> None:
        if not self._runner.worker.offer(partial(self._handle, handle, query)):
            with query:
                query.reply_error(_BUSY)

    def _handle(self, handle: Callable[[Query], None], query: Query) -> None:
        try:
            handle(query)
        except DecodeError as error:
            self._runner.report(_DAMAGED_QUERY, error)
            with query:
                query.reply_error(str(error))

    def _on_resent(self, query: Query) -> None:
        reach = self._keys.reach(query.key, self._keys.of(self._session.zid, "write"))
        number = next(self._numbers)
        event = self._runner.read_batch(query.payload or b"", reach, number)
        if isinstance(event, events.MemberLeft):
            raise DecodeError("parameter batch", 0, "a departure, expected writes")
        self._queries[number] = query
        self._runner.run(event)

    def _on_sync(self, query: Query) -> None:
        request = decode(query.payload or b"", SyncRequest)
        number = next(self._numbers)
        self._queries[number] = query
        self._runner.run(events.SyncReceived(number, request))

    def _on_writes(self, query: Query) -> None:
        reach = self._keys.reach(query.key, self._keys.of(self._session.zid, "tell"))
        request = decode(query.payload or b"", SyncRequest)
        number = next(self._numbers)
        self._queries[number] = query
        self._runner.run(events.WritesReceived(number, request, reach))

    def _reply(self, effect: effects.Reply) -> None:
        query = self._queries.pop(effect.query, None)
        if query is not None:
            with query:
                if isinstance(effect.reply, str):
                    query.reply_error(effect.reply)
                else:
                    query.reply(query.key, encode(effect.reply))
