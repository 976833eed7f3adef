"""Queries, replies, queriers and queryables."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import SimpleNamespace
from typing import Any, Final, Literal, TypedDict

import zenoh

from rosz.errors import ClosedError, TransportError, UsageError
from rosz.lifecycle import Closing
from rosz.session.at_exit import ClosedSession, leak_at_exit
from rosz.session.channels import open_channel
from rosz.session.declared import Declared, translate_errors
from rosz.session.samples import RawItem, Sample, Stamp, to_timestamp
from rosz.worker import ENDING

Target = Literal["all", "all_complete", "best"]
"""Queryables that get a query: all, those declared complete, or the best one of these."""

TARGETS: Final = {
    "all": zenoh.QueryTarget.ALL,
    "all_complete": zenoh.QueryTarget.ALL_COMPLETE,
    "best": zenoh.QueryTarget.BEST_MATCHING,
}
Priority = Literal["urgent", "normal", "background"]
"""Which of the samples, queries and replies that wait for a link goes first."""

PRIORITIES: Final = {
    "urgent": zenoh.Priority.INTERACTIVE_HIGH,
    "normal": zenoh.Priority.DATA,
    "background": zenoh.Priority.DATA_LOW,
}
LONGEST_WAIT = threading.TIMEOUT_MAX / 2
"""Seconds that stand for "forever": more than a century, and the longest wait of the system."""

_CLOSED_QUERY: Final = ClosedSession("the query is closed")


def clamp_timeout(timeout: float) -> float:
    """Return a timeout between 0 and `LONGEST_WAIT`.

    Args:
        timeout: Time limit in seconds; may be infinite.

    Raises:
        UsageError: The timeout is not a number, with which a wait would never end.
    """
    if timeout != timeout:  # noqa: PLR0124  # nan
        raise UsageError(f"timeout is '{timeout}': expected a number of seconds")
    return min(max(timeout, 0.0), LONGEST_WAIT)


class QueryOptions(TypedDict, total=False):
    """Options of a query.

    Attributes:
        payload: The payload of the query.
        attachment: The bytes to send beside the payload.
        parameters: The part of the selector after the ``?``.
        target: Queryables that get the query; all by default.
        any_key: Whether replies may be for keys that the query does not match.
        priority: Whether the query and its replies overtake samples that wait for a slow link
            (``urgent``), or let them pass (``background``).
        cancel: The cancellation that can end the query early; one that was cancelled before makes
            the query raise `ClosedError`.
    """

    payload: bytes | None
    attachment: bytes | None
    parameters: str
    target: Target
    any_key: bool
    cancel: Cancellation | None
    priority: Priority


class Cancellation:
    """Ends all queries that were made with it, and makes further ones raise `ClosedError`.

    Attributes:
        token: The cancellation token of Zenoh.
    """

    def __init__(self) -> None:
        self.token: zenoh.CancellationToken = zenoh.CancellationToken()

    def cancel(self) -> None:
        """End the queries, so that nobody waits for their replies; a second call has no effect."""
        self.token.cancel()  # type: ignore[no-untyped-call]  # missing in zenoh's stub


class Reply(Sample):
    """One reply that arrived; when not ``ok`` its payload is the text of the error."""

    __slots__ = ("ok",)

    def __init__(self, raw: zenoh.Reply) -> None:
        sample: Any = raw.ok
        self.ok: bool = sample is not None
        if not self.ok:
            nothing = dict.fromkeys(("attachment", "timestamp", "kind"))
            sample = SimpleNamespace(key_expr="", payload=raw.result.payload, **nothing)
        super().__init__(sample)


class Replies:
    """The replies to a query; iterating over them ends after the last one or at the timeout.

    Args:
        handler: The channel of Zenoh that the replies come from.
    """

    def __init__(self, handler: Any) -> None:
        self._recv = handler.recv

    def __iter__(self) -> Iterator[Reply]:
        while (reply := self.receive()) is not None:
            yield reply

    def receive(self) -> Reply | None:
        """Wait for the next reply and return it; ``None`` when there are no more."""
        if ENDING.is_set():
            return None
        try:
            return Reply(self._recv())
        except zenoh.ZError:  # the channel is empty and closed
            return None


class Querier(Declared):
    """A declared query, for a key that is queried often.

    Args:
        key: The key expression to query.
        entity: The querier of Zenoh.
        timeout: The time limit that was declared, in seconds.

    Attributes:
        timeout: The time limit that was declared, in seconds.
    """

    def __init__(self, key: str, entity: Any, timeout: float) -> None:
        super().__init__(f"querier '{key}'", entity)
        self._key = key
        self._get = entity.get
        self.timeout = timeout

    def query(self, payload: bytes, attachment: bytes, cancel: Cancellation) -> Replies:
        """Send the query, and return the replies as they come; see `Session.query`.

        Raises:
            ClosedError: The querier or the session is closed, or ``cancel`` was cancelled.
        """
        token = cancel.token
        with self._call(f"query '{self._key}'"):
            handler = self._get(
                open_channel(), payload=payload, attachment=attachment, cancellation_token=token
            )
        return Replies(handler)


def is_key_in(expression: str, key: str) -> bool:
    """Tell whether a Zenoh key expression includes a key."""
    return bool(zenoh.KeyExpr(expression).includes(zenoh.KeyExpr(key)))


class Query(RawItem, Closing):
    """One query that arrived; close it after the last reply, else the querier waits for more."""

    __slots__ = ()

    @property
    def parameters(self) -> str:
        """The part of the selector after the ``?``."""
        return str(self._raw.parameters)

    @property
    def payload(self) -> bytes | None:
        """The payload of the query."""
        raw = self._raw.payload
        return None if raw is None else raw.to_bytes()

    def reply(
        self,
        key: str,
        payload: bytes,
        *,
        attachment: bytes | None = None,
        stamp: Stamp | None = None,
    ) -> None:
        """Send one reply.

        Raises:
            TransportError: The session is closed, or the program is about to end.
        """
        with _replying("reply on", key):
            self._raw.reply(key, payload, attachment=attachment, timestamp=to_timestamp(stamp))

    def forward(
        self, reply: Reply, key: str, payload: bytes | None = None, attachment: bytes | None = None
    ) -> None:
        """Send a reply, or an error, that arrived on another session.

        Args:
            reply: The reply; its payload is not copied.
            key: The key to reply on.
            payload: The payload to send instead.
            attachment: The bytes to send beside the payload.

        Raises:
            TransportError: The session is closed, or the program is about to end.
        """
        content = reply.raw.payload if payload is None else payload
        with _replying("reply on", key):
            if reply.ok:
                self._raw.reply(key, content, attachment=attachment, timestamp=reply.raw.timestamp)
            else:
                self._raw.reply_err(content)

    def reply_error(self, text: str) -> None:
        """Send an error as the reply.

        Raises:
            TransportError: The session is closed, or the program is about to end.
        """
        with _replying("reply"):
            self._raw.reply_err(text.encode())

    def close(self) -> None:
        """Tell the querier that there are no more replies; a second call has no effect."""
        raw, self._raw = self._raw, _CLOSED_QUERY
        if raw is _CLOSED_QUERY:
            return
        if ENDING.is_set():
            leak_at_exit(raw)
        else:
            with suppress(RuntimeError):  # a thread that is about to reply drops it afterwards
                raw.drop()

    def __del__(self) -> None:
        """Close a query that nobody closed."""
        self.close()


class Queryable(Declared):
    """A declared queryable that keeps its queries until a thread receives them."""

    def __init__(self, key: str, entity: Any, channel: Any) -> None:
        super().__init__(f"queryable '{key}'", entity)
        self._recv = channel.recv

    def receive(self) -> Query | None:
        """Wait for a query and return the oldest one; several threads may call this.

        Returns:
            The query, which the caller has to close; ``None`` when the queryable is closed.
        """
        if ENDING.is_set():
            return None
        try:
            return Query(self._recv())
        except zenoh.ZError:
            return None


@contextmanager
def _replying(what: str, key: str = "") -> Iterator[None]:
    if ENDING.is_set():
        raise TransportError("cannot reply: the program ends")
    try:
        with translate_errors(what, key):
            yield
    except ClosedError as error:
        raise TransportError(str(error)) from error
