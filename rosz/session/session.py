"""The Zenoh session: the one way to the network.

No Python runs on the threads of Zenoh: what arrives waits in channels of Zenoh, and threads of
Python receive it from there. Otherwise a link would wait for Python's lock, and a thread of Zenoh
that asks for that lock while the interpreter ends would abort the process.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any, Self, Unpack

import zenoh

from rosz.lifecycle import Closable
from rosz.session import parting
from rosz.session.at_exit import ENDING, ClosedSession, still_open
from rosz.session.config import SessionConfig
from rosz.session.declared import (
    CallbackThread,
    Declared,
    PullSubscriber,
    RawPublisher,
    caching_publisher,
    history_subscriber,
    open_channel,
    translate_errors,
)
from rosz.session.lingering import never_linger
from rosz.session.opening import open_raw
from rosz.session.parting import parting_from_stopped
from rosz.session.presence import Presence, marks, why_silent
from rosz.session.queries import (
    TARGETS,
    Cancellation,
    Querier,
    Query,
    Queryable,
    QueryOptions,
    Replies,
    Reply,
    Target,
)
from rosz.session.samples import HybridClock, Sample, Stamp, to_timestamp
from rosz.session.segments import sweep
from rosz.session.timeouts import clamp_timeout
from rosz.worker import start_thread

if TYPE_CHECKING:
    from types import TracebackType

__all__ = ("Session",)

_CONGESTION = {True: zenoh.CongestionControl.BLOCK, False: zenoh.CongestionControl.DROP}
"""What to do when a link is full, by whether to wait for it."""


class Session:
    """One connection to the network.

    Args:
        raw: The open Zenoh session.
        secured: Whether links beyond the machine need keys.
        rendezvous: Endpoint where the sessions of this machine meet.
    """

    def __init__(self, raw: zenoh.Session, *, secured: bool = False, rendezvous: str = "") -> None:
        self.secured = secured
        self._rendezvous = rendezvous
        self._raw: Any = raw
        self._closing = threading.Lock()
        self._presence: Presence | None = None
        self._links: Closable | None = None
        self.zid = str(raw.zid())
        self.clock = HybridClock(self.zid)

    @classmethod
    def open(cls, config: SessionConfig) -> Session:
        """Open a session.

        Raises:
            TransportError: Nobody answers where one must, an endpoint is occupied or malformed, or
                a configuration value is refused.
            UsageError: The override text is malformed.
        """
        presence = _presence_of(config)
        try:
            raw = open_raw(config, presence)
        except BaseException:
            if presence is not None:
                presence.close()
            raise
        session = cls(raw, secured=config.keys is not None, rendezvous=config.rendezvous)
        if presence is not None:
            presence.tell(session.zid)
            session._presence = presence
        if config.mode != "client" or config.reaches_beyond:
            session._links = never_linger(session._raw)
        return session

    def stamp(self) -> Stamp:
        """Return a new stamp, later than all that this session gave or was shown."""
        return self.clock.now()

    def put(
        self,
        key: str,
        payload: bytes,
        *,
        attachment: bytes | None = None,
        stamp: Stamp | None = None,
        block: bool = True,
    ) -> None:
        """Write a value; unless told not to ``block``, wait for a slow link rather than drop it.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with translate_errors(f"write '{key}'"):
            self._raw.put(
                key,
                payload,
                attachment=attachment,
                timestamp=None if stamp is None else to_timestamp(stamp),
                congestion_control=_CONGESTION[block],
            )

    def delete(
        self, key: str, *, attachment: bytes | None = None, stamp: Stamp | None = None
    ) -> None:
        """Delete a value; waits for a slow link rather than drop the deletion.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with translate_errors(f"delete '{key}'"):
            self._raw.delete(
                key,
                attachment=attachment,
                timestamp=None if stamp is None else to_timestamp(stamp),
                congestion_control=_CONGESTION[True],
            )

    def publisher(
        self,
        key: str,
        *,
        reliable: bool = True,
        block: bool = False,
        cache: int = 0,
    ) -> RawPublisher:
        """Declare a publisher.

        Args:
            key: Key expression.
            reliable: Which kind of link to prefer.
            block: Whether a full link makes ``put`` wait instead of dropping the sample.
            cache: Samples kept for late joiners (transient local); 0 for none.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        congestion = _CONGESTION[block]
        reliability = zenoh.Reliability.RELIABLE if reliable else zenoh.Reliability.BEST_EFFORT
        with translate_errors(f"publish on '{key}'"):
            if not cache:
                plain = self._raw.declare_publisher(
                    key, congestion_control=congestion, reliability=reliability
                )
                return RawPublisher(key, plain)
            keeping = caching_publisher(
                still_open(self._raw),
                key,
                cache,
                congestion_control=congestion,
                reliability=reliability,
            )
            return RawPublisher(key, keeping)

    def subscriber(
        self,
        key: str,
        callback: Callable[[Sample], None],
        *,
        history: int = 0,
        recover: bool = False,
        remote_only: bool = False,
    ) -> Closable:
        """Declare a subscriber.

        Args:
            key: Key expression.
            callback: Gets every sample, on a thread that must not be kept.
            history: Samples per publisher to ask the caches of transient-local publishers for.
            recover: Whether to notice and fetch samples that were missed.
            remote_only: Whether to leave out what this very session publishes.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        origin = zenoh.Locality.REMOTE if remote_only else None
        what = f"subscriber '{key}'"

        def deliver(raw: zenoh.Sample) -> None:
            callback(Sample(raw))

        entity = self._subscribe(key, open_channel(), history, recover, origin)
        return CallbackThread(what, entity, deliver)

    def pull_subscriber(
        self, key: str, depth: int, *, history: int = 0, recover: bool = False
    ) -> PullSubscriber:
        """Declare a subscriber that keeps the newest samples until somebody takes them.

        This is the fastest way to a thread of one's own: what arrives does not wait for Python.

        Args:
            key: Key expression.
            depth: Samples kept; a newer one pushes the oldest out.
            history: Samples per publisher to ask the caches of transient-local publishers for.
            recover: Whether to notice and fetch samples that were missed.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        handler: Any = zenoh.handlers.RingChannel(depth)
        return PullSubscriber(key, self._subscribe(key, handler, history, recover, None))

    def _subscribe(
        self,
        key: str,
        handler: Any,
        history: int,
        recover: bool,
        origin: zenoh.Locality | None,
    ) -> Any:
        with translate_errors(f"subscribe to '{key}'"):
            if not history:
                return self._raw.declare_subscriber(key, handler, allowed_origin=origin)
            return history_subscriber(
                still_open(self._raw), key, handler, history, recover=recover, allowed_origin=origin
            )

    def queryable(
        self, key: str, callback: Callable[[Query], None], *, complete: bool = False
    ) -> Closable:
        """Declare that questions on a key are answered here.

        Args:
            key: Key expression.
            callback: Gets every query, on a thread of its own, and must see to its closing.
            complete: Whether the answers here are all there are; ROS 2 clients ask only such.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with translate_errors(f"serve '{key}'"):
            entity = self._raw.declare_queryable(key, open_channel(), complete=complete)
        return CallbackThread(f"queryable '{key}'", entity, lambda raw: callback(Query(raw)))

    def pull_queryable(self, key: str, *, complete: bool = False) -> Queryable:
        """Declare that questions on a key are answered here, by threads that take them.

        The fastest way to threads of one's own: what arrives does not wait for Python.

        Args:
            key: Key expression.
            complete: Whether the answers here are all there are; ROS 2 clients ask only such.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with translate_errors(f"serve '{key}'"):
            return Queryable(
                key, self._raw.declare_queryable(key, open_channel(), complete=complete)
            )

    def token(self, key: str) -> Closable:
        """Declare a liveliness token: it is seen by others until closed or the link dies.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with translate_errors(f"declare token '{key}'"):
            return Declared(f"token '{key}'", self._raw.liveliness().declare_token(key))

    def watch_tokens(self, key: str, callback: Callable[[str, bool], None]) -> Closable:
        """Watch liveliness tokens, those that exist already first.

        Args:
            key: Key expression that the tokens match.
            callback: Gets a token's key and whether it is alive, on a thread of the watch.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """

        def deliver(raw: zenoh.Sample) -> None:
            callback(str(raw.key_expr), raw.kind == zenoh.SampleKind.PUT)

        with translate_errors(f"watch tokens '{key}'"):
            entity = self._raw.liveliness().declare_subscriber(key, open_channel(), history=True)
        return CallbackThread(f"watch of tokens '{key}'", entity, deliver)

    def query(
        self,
        key: str,
        *,
        timeout: float,
        payload: bytes | None = None,
        attachment: bytes | None = None,
        parameters: str = "",
        target: Target = "all",
        any_key: bool = False,
        cancel: Cancellation | None = None,
    ) -> Replies:
        """Ask, and have the answers to iterate over; one that is not ``ok`` is an error.

        Args:
            key: Key expression to ask for.
            timeout: Seconds after which whoever has not answered is given up; an answer that is not
                ``ok`` with payload ``Timeout`` stands for them.
            payload: Sent along with the question.
            attachment: Sent beside the payload.
            parameters: What follows the ``?`` of the selector.
            target: Who is asked.
            any_key: Whether answers may be for keys outside the one asked for.
            cancel: What may end it early.

        Raises:
            ClosedError: The session is closed, or it is cancelled already.
            TransportError: The key is malformed.
            UsageError: The timeout is no number.
        """
        with translate_errors(f"query '{key}'"):
            handler = self._raw.get(
                f"{key}?{parameters}" if parameters else key,
                open_channel(),
                target=TARGETS[target],
                consolidation=zenoh.ConsolidationMode.NONE,
                accept_replies=zenoh.ReplyKeyExpr.ANY if any_key else None,
                timeout=clamp_timeout(timeout),
                payload=payload,
                attachment=attachment,
                cancellation_token=None if cancel is None else cancel.token,
            )
        return Replies(handler)

    def querier(self, key: str, *, timeout: float, target: Target = "all") -> Querier:
        """Declare a question that is asked often; the arguments are those of `query`.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with translate_errors(f"query '{key}'"):
            entity = self._raw.declare_querier(
                key,
                target=TARGETS[target],
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=clamp_timeout(timeout),
            )
        return Querier(key, entity, timeout)

    def get(self, key: str, *, timeout: float, **options: Unpack[QueryOptions]) -> list[Reply]:
        """Ask, and wait for all answers; the arguments are those of `query`.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        return list(self.query(key, timeout=timeout, **options))

    def get_async(
        self,
        key: str,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
        *,
        timeout: float,
        **options: Unpack[QueryOptions],
    ) -> None:
        """Ask, and have the answers delivered on another thread.

        Args:
            key: Key expression to ask for.
            on_reply: Gets each answer.
            on_done: Called after the last answer, or when the time is over.
            timeout: As for `query`.
            options: As for `query`.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        answers = self.query(key, timeout=timeout, **options)

        def deliver() -> None:
            try:
                for reply in answers:
                    on_reply(reply)
            finally:
                on_done()

        if not start_thread(
            threading.Thread(target=deliver, name=f"rosz answers '{key}'", daemon=True)
        ):
            deliver()

    def live_tokens(self, key: str, timeout: float) -> list[str]:
        """Return the keys of all liveliness tokens that match, sorted.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with translate_errors(f"look for tokens '{key}'"):
            handler = self._raw.liveliness().get(
                key, open_channel(), timeout=clamp_timeout(timeout)
            )
        return sorted({reply.key for reply in Replies(handler) if reply.ok})

    def peers(self) -> list[str]:
        """Return the ids of the sessions and routers that this one is linked to."""
        info = self._raw.info
        return sorted(str(zid) for zid in (*info.peers_zid(), *info.routers_zid()))

    def out_of_reach(self) -> set[str]:
        """Return the ids of those sessions of this machine that are stopped, and answer nobody."""
        return {mark.zid for mark in marks(self._rendezvous) if mark.is_stopped}

    def why_silent(self, *sessions: str) -> str:
        """Say which of some sessions' processes are stopped, and what to do; empty if none is."""
        return why_silent(self._rendezvous, sessions)

    @property
    def closed(self) -> bool:
        """Whether the session has been closed."""
        return isinstance(self._raw, ClosedSession)

    def disown(self, why: str) -> None:
        """Refuse everything from now on, leaving Zenoh alone: after a fork, in the child.

        Args:
            why: What the refusals say.
        """
        import ctypes

        # Zenoh's threads are not here to answer: even to free the session would wait for ever.
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(self._raw))
        self._closing = threading.Lock()
        if self._presence is not None:
            self._presence.close()
        self._raw = ClosedSession(why)
        ENDING.set()

    def close_links(self) -> AbstractContextManager[None]:
        """Return within what nothing waits for processes that are stopped: for the end.

        What is undeclared waits for room in the queue of each link, which one of these has not.
        """
        if self.closed:
            return nullcontext()
        return parting_from_stopped(self._raw, self._rendezvous)

    def close(self) -> None:
        """Close the session and all that is declared on it; again is no error."""
        with self._closing:
            if self.closed:
                return
            raw, self._raw = self._raw, ClosedSession("the session is closed")
            if self._presence is not None:
                self._presence.close()
            parting.close(raw, self._rendezvous)
            del raw
            sweep()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


def _presence_of(config: SessionConfig) -> Presence | None:
    """Return the mark of a session that others may want to meet."""
    if config.mode == "client" or not config.hold_rendezvous:
        return None
    return Presence(config.rendezvous, reachable=config.mode == "peer")
