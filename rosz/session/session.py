"""The Zenoh session: the one door to the network.

No Python runs on Zenoh's threads: what comes waits in channels of Zenoh's, and threads of Python
take it from there. Else a link would wait for Python's lock, and a thread of Zenoh's that wanted it
while the interpreter ends would abort the process.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Self, Unpack

import msgspec
import zenoh

from rosz.errors import TransportError
from rosz.session.advanced import advanced_publisher, advanced_subscriber
from rosz.session.answers import Answers, AskOptions, Target
from rosz.session.config import SessionConfig, key_settings, overrides, zenoh_settings
from rosz.session.declared import (
    Asker,
    Closable,
    Declared,
    Pumped,
    Questions,
    RawPublisher,
    Ring,
    channel,
    mapped,
)
from rosz.session.ending import ClosedSession, still_open
from rosz.session.meeting import open_at
from rosz.session.memory import keep_freed_memory
from rosz.session.presence import Presence
from rosz.session.probe import first_answered
from rosz.session.refusals import refusals, tell_refusals
from rosz.session.samples import Query, Reply, Sample, to_timestamp
from rosz.session.segments import sweep
from rosz.session.stamp import HybridClock, Stamp

if TYPE_CHECKING:
    from types import TracebackType

__all__ = ("Session",)

_TARGETS = {
    "all": zenoh.QueryTarget.ALL,
    "all_complete": zenoh.QueryTarget.ALL_COMPLETE,
    "best": zenoh.QueryTarget.BEST_MATCHING,
}
_CONGESTION = {True: zenoh.CongestionControl.BLOCK, False: zenoh.CongestionControl.DROP}
_NOBODY = "Unable to connect to any of"
_RUNTIME = "ZENOH_RUNTIME"
_ROUTER_RECEIVERS = 16


@contextmanager
def _receivers(mode: str) -> Iterator[None]:
    """Have Zenoh receive on one thread, or on several in a router, unless the user says otherwise.

    Two hand a link's data to each other from core to core, which makes a round trip a quarter
    longer. But a link that is given up holds its thread for seconds, and all links with it: to a
    router that loses several at once, that matters more. Zenoh reads this once, when the first
    session of the process opens.
    """
    given = _RUNTIME in os.environ
    if not given:
        count = _ROUTER_RECEIVERS if mode == "router" else 1
        os.environ[_RUNTIME] = f"(rx: (worker_threads: {count}))"
    try:
        yield
    finally:
        if not given:
            os.environ.pop(_RUNTIME, None)


def _within_reach(config: SessionConfig) -> SessionConfig:
    """Have a client of several places go to the first that answers: Zenoh stays at the very first.

    A command asks where it was told to ask rather than at home; a node is a client of its own hub.

    Raises:
        TransportError: Nobody answers at any of them.
    """
    if config.mode != "client" or not config.connect or config.config_file:
        return config
    home = (config.rendezvous,)
    wanted = (*config.connect, *home) if config.must_connect else (*home, *config.connect)
    place = first_answered(wanted, config.open_timeout)
    if not place:
        raise _nobody(config)
    return msgspec.structs.replace(config, rendezvous=place, connect=())


def _nobody(config: SessionConfig) -> TransportError:
    where = ", ".join(f"'{endpoint}'" for endpoint in config.endpoints)
    return TransportError(
        f"nobody answers at {where} within {config.open_timeout:g} s: start 'rosz core', a launch"
        " or a node there first, or name another place in ROSZ_RENDEZVOUS"
    )


class Session:
    """One connection to the network.

    Args:
        raw: The open Zenoh session.
        secured: Whether links beyond the machine need keys.
    """

    def __init__(self, raw: zenoh.Session, *, secured: bool = False) -> None:
        self.secured = secured
        self._raw: Any = raw
        self._closing = threading.Lock()
        self._presence: Presence | None = None
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
        config = _within_reach(config)
        with mapped("read the Zenoh configuration"):
            if config.config_file:
                settings = zenoh.Config.from_file(config.config_file)
            else:
                settings = zenoh.Config.from_json5(json.dumps(zenoh_settings(config)))
            for path, part in key_settings(config).items():
                settings.insert_json5(path, json.dumps(part))
            for path, text in overrides(config.override).items():
                settings.insert_json5(path, text)
        sweep()
        keep_freed_memory()
        secured = config.keys is not None
        tell_refusals(config)
        where = ", ".join(f"'{endpoint}'" for endpoint in config.endpoints)
        try:
            with mapped(f"open a session ({where})"), _receivers(config.mode):
                if config.mode == "peer" and config.hold_rendezvous:
                    session = cls(open_at(settings, config.rendezvous), secured=secured)
                    session._presence = Presence(config.rendezvous, session.zid)
                    return session
                return cls(zenoh.open(settings), secured=secured)
        except TransportError as error:
            if _NOBODY not in str(error):
                raise
            reasons = "".join(f"; no link to {reason}" for reason in refusals(config))
            raise TransportError(
                f"nobody answers at {where} within {config.open_timeout:g} s{reasons}: start 'rosz"
                " core', a launch or a node there first, or name another place in ROSZ_RENDEZVOUS"
            ) from error

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
        with mapped(f"write '{key}'"):
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
        with mapped(f"delete '{key}'"):
            self._raw.delete(
                key,
                attachment=attachment,
                timestamp=None if stamp is None else to_timestamp(stamp),
                congestion_control=zenoh.CongestionControl.BLOCK,
            )

    def publisher(
        self,
        key: str,
        *,
        reliable: bool = True,
        block: bool = False,
        cache: int = 0,
        express: bool = False,
    ) -> RawPublisher:
        """Declare a publisher.

        Args:
            key: Key expression.
            reliable: Which kind of link to prefer.
            block: Whether a full link makes ``put`` wait instead of dropping the sample.
            cache: Samples kept for late joiners (transient local); 0 for none.
            express: Whether to send each sample at once rather than in batches.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        congestion = _CONGESTION[block]
        reliability = zenoh.Reliability.RELIABLE if reliable else zenoh.Reliability.BEST_EFFORT
        with mapped(f"publish on '{key}'"):
            if not cache:
                plain = self._raw.declare_publisher(
                    key, congestion_control=congestion, reliability=reliability, express=express
                )
                return RawPublisher(key, plain)
            keeping = advanced_publisher(
                still_open(self._raw),
                key,
                cache,
                congestion_control=congestion,
                reliability=reliability,
                express=express,
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

        entity = self._subscribe(key, channel(), history, recover, origin)
        return Pumped(what, entity, deliver)

    def ring(self, key: str, depth: int, *, history: int = 0, recover: bool = False) -> Ring:
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
        return Ring(key, self._subscribe(key, handler, history, recover, None))

    def _subscribe(
        self,
        key: str,
        handler: Any,
        history: int,
        recover: bool,
        origin: zenoh.Locality | None,
    ) -> Any:
        with mapped(f"subscribe to '{key}'"):
            if not history:
                return self._raw.declare_subscriber(key, handler, allowed_origin=origin)
            return advanced_subscriber(
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
        with mapped(f"serve '{key}'"):
            entity = self._raw.declare_queryable(key, channel(), complete=complete)
        return Pumped(f"queryable '{key}'", entity, lambda raw: callback(Query(raw)))

    def questions(self, key: str, *, complete: bool = False) -> Questions:
        """Declare that questions on a key are answered here, by threads that take them.

        The fastest way to threads of one's own: what arrives does not wait for Python.

        Args:
            key: Key expression.
            complete: Whether the answers here are all there are; ROS 2 clients ask only such.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with mapped(f"serve '{key}'"):
            return Questions(key, self._raw.declare_queryable(key, channel(), complete=complete))

    def ask(
        self,
        key: str,
        *,
        timeout: float,
        payload: bytes | None = None,
        attachment: bytes | None = None,
        parameters: str = "",
        target: Target = "all",
        any_key: bool = False,
    ) -> Answers:
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

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        cancel = zenoh.CancellationToken()
        with mapped(f"ask '{key}'"):
            handler = self._raw.get(
                f"{key}?{parameters}" if parameters else key,
                channel(),
                target=_TARGETS[target],
                consolidation=zenoh.ConsolidationMode.NONE,
                accept_replies=zenoh.ReplyKeyExpr.ANY if any_key else None,
                timeout=timeout,
                payload=payload,
                attachment=attachment,
                cancellation_token=cancel,
            )
        return Answers(handler, cancel)

    def asker(self, key: str, *, timeout: float, target: Target = "all") -> Asker:
        """Declare a question that is asked often; the arguments are those of `ask`.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with mapped(f"ask '{key}'"):
            entity = self._raw.declare_querier(
                key,
                target=_TARGETS[target],
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=timeout,
            )
        return Asker(key, entity, timeout)

    def get(self, key: str, *, timeout: float, **options: Unpack[AskOptions]) -> list[Reply]:
        """Ask, and wait for all answers; the arguments are those of `ask`.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        return list(self.ask(key, timeout=timeout, **options))

    def get_async(
        self,
        key: str,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
        *,
        timeout: float,
        **options: Unpack[AskOptions],
    ) -> None:
        """Ask, and have the answers delivered on another thread.

        Args:
            key: Key expression to ask for.
            on_reply: Gets each answer.
            on_done: Called after the last answer, or when the time is over.
            timeout: As for `ask`.
            options: As for `ask`.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        answers = self.ask(key, timeout=timeout, **options)

        def deliver() -> None:
            try:
                for reply in answers:
                    on_reply(reply)
            finally:
                on_done()

        threading.Thread(target=deliver, name=f"rosz answers '{key}'", daemon=True).start()

    def token(self, key: str) -> Closable:
        """Declare a liveliness token: it is seen by others until closed or the link dies.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        with mapped(f"declare token '{key}'"):
            return Declared(f"token '{key}'", self._raw.liveliness().declare_token(key))

    def tokens(self, key: str, callback: Callable[[str, bool], None]) -> Closable:
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

        with mapped(f"watch tokens '{key}'"):
            entity = self._raw.liveliness().declare_subscriber(key, channel(), history=True)
        return Pumped(f"watch of tokens '{key}'", entity, deliver)

    def live_tokens(self, key: str, timeout: float) -> list[str]:
        """Return the keys of all liveliness tokens that match, sorted.

        Raises:
            ClosedError: The session is closed.
            TransportError: The key is malformed.
        """
        cancel = zenoh.CancellationToken()
        with mapped(f"look for tokens '{key}'"):
            handler = self._raw.liveliness().get(
                key, channel(), timeout=timeout, cancellation_token=cancel
            )
        return sorted({reply.key for reply in Answers(handler, cancel) if reply.ok})

    def peers(self) -> list[str]:
        """Return the ids of the sessions and routers that this one is linked to."""
        info = self._raw.info
        return sorted(str(zid) for zid in (*info.peers_zid(), *info.routers_zid()))

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

    def close(self) -> None:
        """Close the session and all that is declared on it; again is no error."""
        with self._closing:
            if self.closed:
                return
            raw, self._raw = self._raw, ClosedSession("the session is closed")
            if self._presence is not None:
                self._presence.close()
            raw.close()
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
