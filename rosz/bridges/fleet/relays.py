"""Passing samples, queries and replies from one session to another, without decoding them.

A relay receives what other sessions send, never what its own sends, so nothing passes twice. Each
relay of a topic has a thread and a ring of the newest samples: a slow link to the one side delays
this thread alone, and the ring is what waits for it.
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

__all__ = ("Calls", "Edit", "Ids", "QueryRelay", "TopicRelay", "prefix_frames", "strip_frames")

log = logging.getLogger("rosz.fleet")

_DEPTH: Final = 10
_DEEPEST: Final = 1000
_CALLS: Final = 256
_WAITING: Final = 1000
_CALL_SECONDS: Final = 600.0
"""The time limit of rmw_zenoh's clients."""
_GID_AT: Final = 17
_SIZE: Final = 33
"""The sizes of an attachment, without its id of a publisher and with it."""
_TOKEN_SECONDS: Final = 2.0
"""Seconds for which the first sample of a publisher waits for its token."""
_PUBLISHERS: Final = 1000
"""Largest number of publishers in each memory: of those that have gone, and of the unknown."""
_RESULT: Final = "/_action/get_result"


def prefix_frames(prefix: str, payload: bytes) -> bytes:
    """Return transforms with a prefix before each frame.

    Raises:
        DecodeError: The bytes do not encode transforms.
    """
    message = TFMessage._decode(payload)
    for transform in message.transforms:
        header = transform.header
        header.frame_id = f"{prefix}/{header.frame_id.lstrip('/')}"
        transform.child_frame_id = f"{prefix}/{transform.child_frame_id.lstrip('/')}"
    return bytes(TFMessage._encode(message))


def strip_frames(prefix: str, payload: bytes) -> bytes:
    """Return transforms whose frames have lost a prefix; others stay as they are.

    Raises:
        DecodeError: The bytes do not encode transforms.
    """
    start = f"{prefix}/"
    message = TFMessage._decode(payload)
    for transform in message.transforms:
        transform.header.frame_id = transform.header.frame_id.removeprefix(start)
        transform.child_frame_id = transform.child_frame_id.removeprefix(start)
    return bytes(TFMessage._encode(message))


class Ids:
    """The ids of publishers on the other side, by their ids on this one.

    Samples and tokens come on different threads. So a sample may be here before the token of its
    publisher, and may still wait here after that token has gone.
    """

    def __init__(self) -> None:
        self._added = threading.Condition()
        self._known: dict[bytes, bytes] = {}
        self._gone: dict[bytes, bytes] = {}
        self._awaited: dict[bytes, float] = {}

    def add(self, gid: bytes, there: bytes) -> None:
        """Note the id on the other side of a publisher that others can see there."""
        with self._added:
            self._known[gid] = there
            self._gone.pop(gid, None)
            self._added.notify_all()

    def remove(self, gid: bytes) -> None:
        """Note that a publisher has gone; the ids of the last of them stay known."""
        with self._added:
            there = self._known.pop(gid, None)
            if there is not None:
                self._gone[gid] = there
                _shorten(self._gone)

    def find(self, gid: bytes) -> bytes | None:
        """Return the id of a publisher on the other side, or None if the publisher is unknown.

        An unknown publisher gets 2 seconds to become known, but only once.
        """
        found = self._known.get(gid)
        if found is not None:
            return found
        with self._added:
            deadline = self._awaited.setdefault(gid, time.monotonic() + _TOKEN_SECONDS)
            _shorten(self._awaited)
            left = max(0.0, deadline - time.monotonic())
            self._added.wait_for(lambda: gid in self._known or gid in self._gone, left)
            return self._known.get(gid) or self._gone.get(gid)


def _shorten(found: dict[bytes, Any]) -> None:
    while len(found) > _PUBLISHERS:
        del found[next(iter(found))]


class Edit:
    """The changes to the samples of one topic as they pass.

    Args:
        ids: The ids of publishers on the other side.
        payload: Function that returns the payload to send; samples pass as they are without it.
    """

    def __init__(self, ids: Ids, payload: Callable[[bytes], bytes] | None = None) -> None:
        self._ids = ids
        self._payload = payload

    def attachment(self, sample: Sample) -> bytes | None:
        """Return the bytes to send beside the payload: a publisher has another id there."""
        data = sample.attachment
        if data is None:
            return None
        gid = self._ids.find(data[_GID_AT:]) if len(data) == _SIZE else None
        return data if gid is None else data[:_GID_AT] + gid

    def payload(self, sample: Sample) -> bytes | None:
        """Return the payload to send; ``None`` if it is that of the sample.

        Raises:
            DecodeError: The sample is damaged.
        """
        return None if self._payload is None else self._payload(sample.payload)


class TopicRelay:
    """Passes the samples of one topic on, until closed.

    Args:
        source: The session to receive on.
        source_key: The key of the topic there.
        target: The session to publish on.
        target_key: The key of the topic there.
        qos: The QoS of the subscription that asks for the samples.
        rate: Largest number of samples per second of each publisher; infinity for no limit.
        edit: What changes in the samples.
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
        # A reliable sample waits for the link, on the thread of this relay alone.
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
        if self._period and not (attachment := self._limit(attachment)):
            return
        try:
            self._publisher.forward(sample, self._edit.payload(sample), attachment)
        except ClosedError:
            return
        except DecodeError as error:
            if not self._damaged:
                self._damaged = True
                log.warning("what comes on '%s' does not pass (told once): %s", self._key, error)

    def _limit(self, attachment: bytes | None) -> bytes | None:
        """Return the attachment of a sample that is due, with a number that leaves no gap."""
        try:
            sequence, published, gid = read_attachment(attachment)
        except DecodeError:
            return attachment
        now, due = time.monotonic(), self._due.get(gid, 0.0)
        if now < due:
            return None
        # A sample that is late by less than a period does not delay those after it.
        self._due[gid] = (due if now - due < self._period else now) + self._period
        self._sent[gid] = number = self._sent.get(gid, sequence - 1) + 1
        while len(self._due) > _DEEPEST:
            oldest = next(iter(self._due))
            del self._due[oldest], self._sent[oldest]
        return pack_attachment(number, published, gid)

    def close(self) -> None:
        """Pass nothing more; a second call has no effect."""
        self._subscriber.close()
        self._publisher.close()


class Calls:
    """The threads on which queries wait for their replies; a limited number of them."""

    def __init__(self) -> None:
        self._worker: Worker[Callable[[], object]] = Worker(
            "rosz-fleet-call", threads=_CALLS, capacity=_WAITING, logger=log
        )

    def add(self, query: Query, handle: Callable[[Query], object]) -> None:
        """Handle a query on a thread, or reply that there are too many."""
        if not self._worker.offer(partial(handle, query)):
            with query:
                query.reply_error("too many calls wait for the robot")

    def close(self) -> None:
        """Start no more of them; a second call has no effect."""
        self._worker.close(0)


class QueryRelay:
    """Passes queries on, and the replies back, until closed.

    Args:
        asked: The session on which the queries come.
        asked_key: The key expression that they match.
        served: The session to query.
        calls: The threads.
        there: Function that returns the key expression to query for that of a query.
        back: Function that returns the key to reply on for that of a reply.
        edit: What changes in the replies; nothing if not given.
    """

    def __init__(
        self,
        asked: Session,
        asked_key: str,
        served: Session,
        calls: Calls,
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
        self._calls.add(query, self._handle)

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
                return  # one of the sides ends
            except RoszError as error:
                log.warning("a call of '%s' did not pass: %s", query.key, error)

    def close(self) -> None:
        """Pass nothing more, and end what waits; a second call has no effect."""
        self._queryable.close()
        self._cancel.cancel()
