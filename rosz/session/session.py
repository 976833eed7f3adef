"""The Zenoh session, which all communication uses.

Arrived items wait in channels (`rosz.session.channels`), from which threads of Python receive them.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import cache, partial
from typing import Any, Unpack
from weakref import WeakValueDictionary

import zenoh
import zenoh.ext

from rosz.errors import ClosedError
from rosz.lifecycle import Closable, Closing, Lifecycle
from rosz.session.at_exit import OPEN, ClosedSession
from rosz.session.channels import declare, declare_callback, open_channel
from rosz.session.config import SessionConfig
from rosz.session.declared import (
    Callbacks,
    Declared,
    PullSubscriber,
    QueueSubscriber,
    RawPublisher,
    translate_errors,
)
from rosz.session.local_peers import LocalPeers, LocalRegistration, direct_endpoint
from rosz.session.opening import open_raw
from rosz.session.queries import (
    PRIORITIES,
    TARGETS,
    Priority,
    Querier,
    Query,
    Queryable,
    QueryOptions,
    Replies,
    Reply,
    Target,
    clamp_timeout,
)
from rosz.session.samples import HybridClock, Sample, Stamp, to_timestamp
from rosz.session.token_watch import LOOK_SECONDS, TokenWatch
from rosz.session.zenoh_workarounds import (
    close_links,
    close_links_at_once,
    remove_abandoned_segments,
)
from rosz.wire import Endpoint
from rosz.worker import ENDING, lend_thread

_CONGESTION = {True: zenoh.CongestionControl.BLOCK, False: zenoh.CongestionControl.DROP}
"""Congestion control for a full link, by whether to wait for it."""
_ORIGIN = {True: zenoh.Locality.REMOTE, False: None}
_HEARTBEAT_SECONDS = 0.5
_TOKENS_SECONDS = 10.0
"""Seconds in which the tokens come that exist when a watch begins; nobody waits for a process that
is stopped, but those of a busy router come late."""

_log = logging.getLogger("rosz.session")


@cache
def _runtime() -> Lifecycle:
    """Return the lifecycle of Zenoh's threads, which start with the first session of a process.

    They never end, and a forked child does not have them: a session would never be open there.
    """
    return Lifecycle("the network")


class Session(Closing):
    """One connection to the network.

    Every method raises `ClosedError` when the session is closed, `PanicError` when Zenoh panics.
    Those that take a key raise `InvalidName` when it is too long, `TransportError` when it is
    malformed; those that take a timeout raise `UsageError` when it is not a number.

    Args:
        raw: The open session of Zenoh.
        secured: Whether links beyond the machine need keys.
        rendezvous: The endpoint where the sessions of this machine meet.

    Attributes:
        secured: Whether links beyond the machine need keys.
        zid: The id of the session, in lower-case hex.
        clock: The clock that stamps its writes.
        others: The other sessions of this machine, as they were before it opened; if it is
            registered itself, those that read them later see it.
    """

    def __init__(self, raw: zenoh.Session, *, secured: bool = False, rendezvous: str = "") -> None:
        self.secured = secured
        self.others: LocalPeers = LocalPeers(rendezvous, ())
        self.zid: str = str(raw.zid())
        self.clock: HybridClock = HybridClock(self.zid)
        self._raw: Any = raw
        self._lifecycle = Lifecycle("the session", log=_log, on_fork=self._close_in_child)
        self._registration: LocalRegistration | None = None
        self._link_watch: Closable | None = None
        self._ports: list[int] = []
        self._tokens: WeakValueDictionary[str, Declared] = WeakValueDictionary()

    @classmethod
    def open(cls, config: SessionConfig, peers: LocalPeers | None = None) -> Session:
        """Open a session.

        Args:
            config: The configuration.
            peers: The sessions of this machine, if the caller has read them just now. A session
                that is registered itself reads them again, to see others that open meanwhile.

        Raises:
            TransportError: Nobody answers although the configuration requires a link, an endpoint
                is occupied or malformed, or a configuration value is refused.
            UsageError: The override text is malformed.
            ClosedError: This process was forked from one that had opened a session.
        """
        _runtime().check_open("open a session")
        if config.mode == "client" or (config.mode == "router" and not config.hold_rendezvous):
            others = peers or LocalPeers.read(config.rendezvous)
            raw = open_raw(config, others)
            registration = None
        else:
            reachable = config.mode == "peer" or config.rendezvous_is_held
            registration = LocalRegistration(config.rendezvous, reachable=reachable)
            try:
                others = LocalPeers.read(config.rendezvous, registration.peer)
                raw = open_raw(config, others, registration.peer)
            except BaseException:
                registration.close()
                raise
            registration.opened(str(raw.zid()))
        session = cls(raw, secured=config.keys is not None, rendezvous=config.rendezvous)
        session._registration, session.others = registration, others
        if config.mode != "client":
            ends = map(Endpoint, (config.rendezvous, *config.listen, *config.connect))
            ports = (registration.peer.port if registration else 0, *(end.port for end in ends))
            session._ports = [port for port in ports if port]
        if config.mode != "client" or config.reaches_beyond:
            session._link_watch = close_links_at_once(raw)
        return session

    def stamp(self) -> Stamp:
        """Return a new stamp, later than all that this session made or observed."""
        return self.clock.now()

    def put(
        self,
        key: str,
        payload: bytes,
        *,
        attachment: bytes | None = None,
        stamp: Stamp | None = None,
        block: bool = True,
        priority: Priority = "normal",
    ) -> None:
        """Write a value.

        Args:
            key: The key to write.
            payload: The value.
            attachment: The bytes to send beside the payload.
            stamp: The time of the write.
            block: Whether to wait for a slow link instead of dropping the write.
            priority: Whether the write overtakes others that wait for a slow link.
        """
        with translate_errors("write", key):
            self._raw.put(
                key,
                payload,
                attachment=attachment,
                timestamp=to_timestamp(stamp),
                congestion_control=_CONGESTION[block],
                priority=PRIORITIES[priority],
            )

    def delete(
        self, key: str, *, attachment: bytes | None = None, stamp: Stamp | None = None
    ) -> None:
        """Delete a value, waiting for a slow link rather than dropping the deletion."""
        with translate_errors("delete", key):
            self._raw.delete(
                key,
                attachment=attachment,
                timestamp=to_timestamp(stamp),
                congestion_control=_CONGESTION[True],
            )

    def publisher(
        self,
        key: str,
        *,
        reliable: bool = True,
        block: bool = False,
        express: bool = False,
        cache: int = 0,
        remote_only: bool = False,
    ) -> RawPublisher:
        """Declare a publisher.

        Args:
            key: The key expression to publish on.
            reliable: Whether links should be reliable.
            block: Whether a full link makes ``put`` wait instead of dropping the sample.
            express: Whether a sample never waits for others to be sent together.
            cache: The number of samples kept for late joiners (transient local); 0 for none.
            remote_only: Whether subscribers of this session receive nothing, but from the cache.
        """
        reliability = zenoh.Reliability.RELIABLE if reliable else zenoh.Reliability.BEST_EFFORT
        qos: Any = {"congestion_control": _CONGESTION[block], "reliability": reliability}
        qos |= {"allowed_destination": _ORIGIN[remote_only], "express": express}
        raw = self._raw  # before the check, since another thread may close the session
        self._lifecycle.check_open(f"publish on '{key}'")
        with translate_errors("publish on", key):
            if not cache:
                return RawPublisher(key, raw.declare_publisher(key, **qos))
            # As rmw_zenoh does it. Zenoh requires both arguments of the detection.
            detection = zenoh.ext.MissDetectionConfig(
                heartbeat=None, sporadic_heartbeat=_HEARTBEAT_SECONDS
            )
            caching = zenoh.ext.declare_advanced_publisher(
                raw,
                key,
                cache=zenoh.ext.CacheConfig(cache),
                publisher_detection=True,
                sample_miss_detection=detection if reliable else None,
                **qos,
            )
            return RawPublisher(key, caching)

    def subscriber(
        self,
        key: str,
        callback: Callable[[Sample], None],
        *,
        history: int = 0,
        remote_only: bool = False,
        rare: bool = False,
    ) -> Closable:
        """Declare a subscriber that calls back.

        Args:
            key: The key expression to subscribe to.
            callback: Function called with each sample on the subscriber's thread; it should return
                soon.
            history: The number of samples to ask each transient-local publisher for.
            remote_only: Whether to ignore samples of this session itself.
            rare: Whether samples arrive rarely, and may wait; waiting for them costs less then.
        """
        make = declare_callback if rare else declare
        declared = make(lambda handler: self._subscribe(key, handler, history, False, remote_only))
        return Callbacks(f"subscriber '{key}'", declared, lambda raw: callback(Sample(raw)))

    def pull_subscriber(self, key: str, depth: int, *, remote_only: bool = False) -> PullSubscriber:
        """Declare a subscriber that keeps the newest samples until a thread receives them.

        Args:
            key: The key expression to subscribe to.
            depth: The number of samples to keep; a new one replaces the oldest.
            remote_only: Whether to ignore samples of this session itself.
        """
        handler: Any = zenoh.handlers.RingChannel(depth)
        return PullSubscriber(key, self._subscribe(key, handler, 0, False, remote_only))

    def queue_subscriber(
        self,
        key: str,
        depth: int,
        handle: Callable[[Sample], object],
        *,
        fit: Callable[[int], int] | None = None,
        history: int = 0,
        recover: bool = False,
        remote_only: bool = False,
    ) -> Closable:
        """Declare a subscriber that keeps the newest samples, and handles them one at a time.

        Args:
            key: The key expression to subscribe to.
            depth: The largest number of samples to keep; a new one replaces the oldest.
            handle: Function called with each sample, on a thread of Python; it may take its time.
            fit: Function that returns how many samples of a size in bytes may wait, where these are
                fewer than the depth. It is called with each sample; the number that it returns
                should rarely fall.
            history: The number of samples to ask each transient-local publisher for.
            recover: Whether to notice and fetch samples that were missed.
            remote_only: Whether to ignore samples of this session itself.
        """
        declare = partial(
            self._subscribe, key, history=history, recover=recover, remote_only=remote_only
        )
        return QueueSubscriber(key, declare, depth, handle, fit=fit, history=bool(history))

    def _subscribe(
        self, key: str, handler: Any, history: int, recover: bool, remote_only: bool
    ) -> Any:
        raw, origin = self._raw, _ORIGIN[remote_only]
        self._lifecycle.check_open(f"subscribe to '{key}'")
        with translate_errors("subscribe to", key):
            if not history:
                return raw.declare_subscriber(key, handler, allowed_origin=origin)
            # As rmw_zenoh does it.
            recovery = zenoh.ext.RecoveryConfig(heartbeat=True, periodic_queries=None)
            return zenoh.ext.declare_advanced_subscriber(
                raw,
                key,
                handler,
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=history),
                recovery=recovery if recover else None,
                subscriber_detection=True,
                allowed_origin=origin,
            )

    def queryable(
        self, key: str, callback: Callable[[Query], None], *, complete: bool = False
    ) -> Closable:
        """Declare a queryable that calls back.

        Args:
            key: The key expression whose queries get replies here.
            callback: Function called with each query on the queryable's thread; it has to close the
                query.
            complete: Whether the replies are all there are; ROS 2 clients query only such.
        """
        with translate_errors("serve", key):
            declared = declare_callback(
                partial(self._raw.declare_queryable, key, complete=complete)
            )
        return Callbacks(f"queryable '{key}'", declared, lambda raw: callback(Query(raw)))

    def pull_queryable(
        self, key: str, *, complete: bool = False, remote_only: bool = False
    ) -> Queryable:
        """Declare a queryable that keeps its queries until a thread receives them.

        Args:
            key: The key expression whose queries get replies here.
            complete: Whether the replies are all there are; ROS 2 clients query only such.
            remote_only: Whether to ignore the queries of this session itself.
        """
        options: Any = {"complete": complete, "allowed_origin": _ORIGIN[remote_only]}
        with translate_errors("serve", key):
            return Queryable(key, *declare(partial(self._raw.declare_queryable, key, **options)))

    def token(self, key: str) -> Closable:
        """Declare a liveliness token, which others see until it is closed or the link ends."""
        with translate_errors("declare token", key):
            token = Declared(f"token '{key}'", self._raw.liveliness().declare_token(key))
        self._tokens[key] = token
        return token

    def watch_tokens(
        self,
        key: str,
        callback: Callable[[str, bool], None],
        complete: Callable[[], object] | None = None,
        *,
        many: bool = False,
    ) -> Closable:
        """Watch liveliness tokens, beginning with those that exist already.

        Args:
            key: The key expression that the tokens match.
            callback: Function called on the watch's thread with the key of a token, and with
                whether it appeared (true) or disappeared (false).
            complete: Function called there once the tokens that existed at the beginning have
                been reported.
            many: Whether hundreds of tokens may come at once; watching costs more then.
        """
        watch = TokenWatch(callback, self._tokens, lambda: self.live_tokens(key, _TOKENS_SECONDS))
        make = declare if many else declare_callback
        with translate_errors("watch tokens", key):
            liveliness = self._raw.liveliness()
            declared = make(partial(liveliness.declare_subscriber, key, history=True))
            if complete is not None:
                watch.complete = complete
                # After the watch: when the last reply has come, its channel has the tokens that
                # existed, except those that another watch received before, which the replies name.
                handler = liveliness.get(key, open_channel(), timeout=_TOKENS_SECONDS)
                watch.existing = Replies(handler)
        what = f"watch of tokens '{key}'"
        return Callbacks(what, declared, watch.deliver, watch.begin, watch.idle)

    def query(self, key: str, *, timeout: float, **options: Unpack[QueryOptions]) -> Replies:
        """Send a query, and return the replies as they come; one that is not ``ok`` is an error.

        Args:
            key: The key expression to query.
            timeout: Time limit in seconds. When it is reached, one reply that is not ``ok``, with
                the payload ``Timeout``, stands for all who have not replied.
            options: The options; see `QueryOptions`.
        """
        parameters, cancel = options.get("parameters"), options.get("cancel")
        with translate_errors("query", key):
            handler = self._raw.get(
                f"{key}?{parameters}" if parameters else key,
                open_channel(),
                target=TARGETS[options.get("target", "all")],
                consolidation=zenoh.ConsolidationMode.NONE,
                accept_replies=zenoh.ReplyKeyExpr.ANY if options.get("any_key") else None,
                priority=PRIORITIES[options.get("priority", "normal")],
                timeout=clamp_timeout(timeout),
                payload=options.get("payload"),
                attachment=options.get("attachment"),
                cancellation_token=None if cancel is None else cancel.token,
            )
        return Replies(handler)

    def querier(self, key: str, *, timeout: float, target: Target = "all") -> Querier:
        """Declare a query that is made often; the arguments are those of `query`."""
        with translate_errors("query", key):
            entity = self._raw.declare_querier(
                key,
                target=TARGETS[target],
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=clamp_timeout(timeout),
            )
        return Querier(key, entity, timeout)

    def get(self, key: str, *, timeout: float, **options: Unpack[QueryOptions]) -> list[Reply]:
        """Send a query, and wait for all replies; the arguments are those of `query`."""
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
        """Send a query, and call back for each reply on another thread.

        Args:
            key: The key expression to query.
            on_reply: Function called with each reply.
            on_done: Function called after the last reply, or when the time limit is reached.
            timeout: Time limit in seconds, as for `query`.
            options: The options of `query`.
        """
        replies = self.query(key, timeout=timeout, **options)

        def deliver() -> None:
            try:
                for reply in replies:
                    on_reply(reply)
            finally:
                on_done()

        if not lend_thread(deliver):
            deliver()

    def live_tokens(self, key: str, timeout: float, looks: int = 1) -> list[str]:
        """Return the keys of all liveliness tokens that match, sorted.

        One query may miss a token on a busy machine. The results of ``looks`` queries are united.
        """
        live = set(self.query_tokens(key, timeout)())
        for _ in range(looks - 1):
            time.sleep(LOOK_SECONDS)
            live.update(self.query_tokens(key, timeout)())
        return sorted(live)

    def query_tokens(self, key: str, timeout: float) -> Callable[[], list[str]]:
        """Query liveliness tokens; the function returned waits for what `live_tokens` returns."""
        with translate_errors("look for tokens", key):
            handler = self._raw.liveliness().get(
                key, open_channel(), timeout=clamp_timeout(timeout)
            )
        return lambda: sorted({reply.key for reply in Replies(handler) if reply.ok})

    def peers(self, *, routers: bool = True) -> list[str]:
        """Return the ids of the peers that this session is linked to, and of the routers."""
        info = self._raw.info
        others = info.routers_zid() if routers else ()
        return sorted(str(zid) for zid in (*info.peers_zid(), *others))

    @property
    def local_endpoint(self) -> str:
        """The endpoint where sessions of this machine can reach this one; empty if there is none.

        It is known on Linux only.
        """
        return (
            ""
            if self._registration is None
            else direct_endpoint(self.others.rendezvous, self._registration.peer)
        )

    def links(self) -> dict[str, list[str]]:
        """Return the other ends of the links of this session, by the ids of their sessions."""
        if ENDING.is_set():
            raise ClosedError("cannot look for links: the program ends")
        ends: dict[str, list[str]] = {}
        with translate_errors("look for links"):
            for link in self._raw.info.links():
                ends.setdefault(str(link.zid), []).append(str(link.dst))
        return ends

    def out_of_reach(self) -> set[str]:
        """Return the ids of the sessions of this machine whose processes are stopped."""
        return {peer.zid for peer in LocalPeers.read(self.others.rendezvous).stopped}

    def why_silent(self, *sessions: str) -> str:
        """Return which of some sessions are stopped, and what to do; empty if none is."""
        return LocalPeers.read(self.others.rendezvous).why_silent(sessions)

    @property
    def closed(self) -> bool:
        """Whether the session has been closed."""
        return isinstance(self._raw, ClosedSession)

    def close_links(self) -> AbstractContextManager[None]:
        """Return a context for undeclaring many things before the session closes.

        To undeclare something, Zenoh waits for room in the queue of each link. In this context,
        links to stopped processes are closed if they have none.
        """
        return nullcontext() if self.closed else close_links(self._raw, self.others.rendezvous)

    def close(self) -> None:
        """Close the session and all that is declared on it; a second call has no effect."""
        self._lifecycle.close(self._disconnect)

    def _disconnect(self) -> None:
        raw, self._raw = self._raw, ClosedSession("the session is closed")
        if self._registration is not None:
            self._registration.close()
        links = close_links(raw, self.others.rendezvous, self._ports)
        with links, translate_errors("close the session"):
            try:
                raw.close()
            except zenoh.ZError as error:
                _log.warning(
                    "a link took no more data when its session closed, and what was still queued"
                    " for it is lost: %s",
                    str(error).partition(" at ")[0],
                )
        del raw
        remove_abandoned_segments()

    def _close_in_child(self) -> None:
        """Refuse everything in a forked child, without touching Zenoh."""
        import ctypes

        # The threads of Zenoh are not in this process: even freeing the session would never return.
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(self._raw))
        if self._registration is not None:
            self._registration.close()
        self._raw = ClosedSession(self._lifecycle.reason)
        ENDING.set()
        OPEN.clear()
