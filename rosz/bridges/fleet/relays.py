"""Relays, which pass samples, queries and replies between sessions without decoding them.

A relay receives only what other sessions send, not what its own session sends, so nothing passes
twice. Each topic relay has a thread and a ring buffer of the newest samples. A slow link delays
only this thread, while samples wait in the buffer.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any, Final

from rosz.errors import ClosedError, DecodeError, RoszError
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.qos import QoS
from rosz.session import LONGEST_WAIT, Cancellation, Query, Sample, Session
from rosz.wire import pack_attachment, read_attachment
from rosz.worker import Worker

log = logging.getLogger("rosz.fleet")

_DEPTH: Final = 10
_DEEPEST: Final = 1000
"""Smallest and largest size of the ring buffer of a topic, in samples."""
_CALLS: Final = 256
_WAITING: Final = 1000
"""Largest numbers of calls that are handled at once, and that wait."""
_CALL_SECONDS: Final = 600.0
"""Time limit of a call; that of rmw_zenoh's clients."""
_GID_AT: Final = 17
_SIZE: Final = 33
"""The size of an attachment, without and with the id of the publisher at its end."""
_TOKEN_SECONDS: Final = 2.0
"""Seconds that the first sample of a publisher waits for the token of the publisher."""
_PUBLISHERS: Final = 1000
"""Largest number of publishers that are remembered after their end, and of unknown ones."""
_RESULT: Final = "/_action/get_result"


def rename_frames(rename: Callable[[str], str], payload: bytes) -> bytes:
    """Return encoded transforms with renamed frames.

    Raises:
        DecodeError: The bytes do not encode transforms.
    """
    message = TFMessage._decode(payload)
    for transform in message.transforms:
        transform.header.frame_id = rename(transform.header.frame_id)
        transform.child_frame_id = rename(transform.child_frame_id)
    return bytes(TFMessage._encode(message))


class Ids:
    """The ids of publishers on the other side, by their ids on this side.

    Samples and tokens arrive on different threads. So a sample may arrive before the token of its
    publisher, and may still wait here after the end of that token.
    """

    def __init__(self) -> None:
        self._added = threading.Condition()
        self._known: dict[bytes, bytes] = {}
        self._gone: dict[bytes, bytes] = {}
        self._awaited: dict[bytes, float] = {}

    def add(self, gid: bytes, there: bytes) -> None:
        """Store the id of a publisher on the other side, where it is declared now."""
        with self._added:
            self._known[gid] = there
            self._gone.pop(gid, None)
            self._added.notify_all()

    def remove(self, gid: bytes) -> None:
        """Remove a publisher; the ids of the most recently removed ones can still be found."""
        with self._added:
            there = self._known.pop(gid, None)
            if there is not None:
                self._gone[gid] = there
                _shorten(self._gone)

    def find(self, gid: bytes) -> bytes | None:
        """Return the id of a publisher on the other side, or None if the publisher is unknown.

        An unknown publisher gets 2 seconds to become known, but only once.
        """
        there = self._known.get(gid)
        if there is not None:
            return there
        with self._added:
            deadline = self._awaited.setdefault(gid, time.monotonic() + _TOKEN_SECONDS)
            _shorten(self._awaited)
            left = max(0.0, deadline - time.monotonic())
            self._added.wait_for(lambda: gid in self._known or gid in self._gone, left)
            return self._known.get(gid) or self._gone.get(gid)


def _shorten(memory: dict[bytes, Any]) -> None:
    while len(memory) > _PUBLISHERS:
        del memory[next(iter(memory))]


class Edit:
    """The changes to the samples of one topic as they pass.

    Args:
        ids: The ids of publishers on the other side.
        payload: Function that returns the payload to send; payloads are unchanged when not given.
    """

    def __init__(self, ids: Ids, payload: Callable[[bytes], bytes] | None = None) -> None:
        self._ids = ids
        self._payload = payload

    def attachment(self, sample: Sample) -> bytes | None:
        """Return the attachment to send, with the publisher's id on the other side."""
        data = sample.attachment
        if data is None:
            return None
        gid = self._ids.find(data[_GID_AT:]) if len(data) == _SIZE else None
        return data if gid is None else data[:_GID_AT] + gid

    def payload(self, sample: Sample) -> bytes | None:
        """Return the payload to send; ``None`` if it is unchanged.

        Raises:
            DecodeError: The sample is damaged.
        """
        return None if self._payload is None else self._payload(sample.payload)


class TopicRelay:
    """Passes the samples of one topic from one session to another, until closed.

    Args:
        qos: The QoS of the subscription for which the samples pass.
        rate: Largest number of samples per second of each publisher; infinity for no limit.
            Samples without a legible attachment count as those of one publisher.
    """

    def __init__(
        self,
        source: Session,
        source_key: str,
        target: Session,
        target_key: str,
        *,
        qos: QoS,
        rate: float,
        edit: Edit,
    ) -> None:
        self._edit = edit
        self._period = 0.0 if rate == math.inf else 1 / rate
        self._due: dict[bytes, float] = {}
        self._sent: dict[bytes, int] = {}
        self._key = source_key
        self._damaged = False
        # A reliable sample blocks until the link takes it, but only on the thread of this relay.
        self._publisher = target.publisher(target_key, reliable=qos.reliable, block=qos.reliable)
        depth = _DEEPEST if qos.history == "keep_all" else min(max(qos.depth, _DEPTH), _DEEPEST)
        self._subscriber = source.pull_subscriber(source_key, depth, remote_only=True)
        Worker(f"rosz-fleet {source_key}", self._pass, receive=self._receive, logger=log)

    def _receive(self) -> Sample | None:
        try:
            return self._subscriber.receive()
        except ClosedError:
            return None

    def _pass(self, sample: Sample) -> None:
        attachment = self._edit.attachment(sample)
        if self._period:
            try:
                sequence, published, gid = read_attachment(attachment)
            except DecodeError:  # a plain Zenoh program sent it
                if not self._is_due(b""):
                    return
            else:
                if not self._is_due(gid):
                    return
                # Numbers without gaps: the samples that the limit drops are not lost ones.
                self._sent[gid] = number = self._sent.get(gid, sequence - 1) + 1
                attachment = pack_attachment(number, published, gid)
        try:
            self._publisher.forward(sample, self._edit.payload(sample), attachment)
        except ClosedError:
            return
        except DecodeError as error:
            if not self._damaged:
                self._damaged = True
                log.warning("dropping damaged samples on '%s' (told once): %s", self._key, error)

    def _is_due(self, gid: bytes) -> bool:
        """Return whether the rate lets a sample of a publisher pass now."""
        now, due = time.monotonic(), self._due.pop(gid, 0.0)
        passes = now >= due
        if passes:
            # A sample that is late by less than a period does not delay the samples after it.
            due = (due if now - due < self._period else now) + self._period
        self._due[gid] = due  # at the end: those at the beginning send no more
        while len(self._due) > _DEEPEST:
            oldest = next(iter(self._due))
            del self._due[oldest]
            self._sent.pop(oldest, None)
        return passes

    def close(self) -> None:
        """Stop passing samples; a second call has no effect."""
        self._subscriber.close()
        self._publisher.close()


def call_worker() -> Worker[Callable[[], object]]:
    """Return the worker whose threads wait for the replies of queries; both are limited."""
    return Worker("rosz-fleet-call", threads=_CALLS, capacity=_WAITING, logger=log)


class QueryRelay:
    """Passes queries to another session, and the replies back, until closed.

    Args:
        there: Function that maps the key expression of a query to the other session.
        back: Function that maps the key of a reply back.
        edit: Changes to the replies; replies are unchanged when not given.
    """

    def __init__(
        self,
        asked: Session,
        asked_key: str,
        served: Session,
        calls: Worker[Callable[[], object]],
        *,
        there: Callable[[str], str],
        back: Callable[[str], str],
        edit: Edit | None = None,
    ) -> None:
        self._served = served
        self._calls = calls
        self._there, self._back = there, back
        self._edit = edit
        self._cancel = Cancellation()
        self._patience = LONGEST_WAIT if _RESULT in asked_key else _CALL_SECONDS
        self._queryable = asked.pull_queryable(asked_key, complete=edit is None, remote_only=True)
        Worker(f"rosz-fleet {asked_key}", self._accept, receive=self._queryable.receive, logger=log)

    def _accept(self, query: Query) -> None:
        """Handle a query on another thread, or reply with an error if too many wait."""
        if not self._calls.offer(partial(self._handle, query)):
            with query:
                query.reply_error("too many calls wait for the robot")

    def _handle(self, query: Query) -> None:
        edit = self._edit
        with query:
            try:
                replies = self._served.query(
                    self._there(query.key),
                    timeout=self._patience,
                    payload=query.payload,
                    attachment=query.attachment,
                    parameters=query.parameters,
                    target="all_complete" if edit is None else "all",
                    any_key=edit is not None,
                    cancel=self._cancel,
                )
                for reply in replies:
                    if edit is None or not reply.ok:
                        query.forward(reply, self._back(reply.key), None, reply.attachment)
                    else:
                        payload, attachment = edit.payload(reply), edit.attachment(reply)
                        query.forward(reply, self._back(reply.key), payload, attachment)
            except ClosedError:
                return  # one of the sessions is being closed
            except RoszError as error:
                log.warning("a call of '%s' failed: %s", query.key, error)

    def close(self) -> None:
        """Stop passing queries, and cancel waiting calls; a second call has no effect."""
        self._queryable.close()
        self._cancel.cancel()
