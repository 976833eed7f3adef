"""What a session declares: what it publishes, takes in and answers, and that it is there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import zenoh

from rosz.session.advanced import advanced_publisher, advanced_subscriber
from rosz.session.declared import (
    Closable,
    Declared,
    Pumped,
    Questions,
    RawPublisher,
    Ring,
    channel,
    mapped,
)
from rosz.session.ending import still_open
from rosz.session.samples import Query, Sample

__all__ = ("CONGESTION", "Declaring")

CONGESTION = {True: zenoh.CongestionControl.BLOCK, False: zenoh.CongestionControl.DROP}
"""What to do where a link is full, by whether to wait for it."""


class Declaring:
    """The declaring half of a session."""

    _raw: Any

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
        congestion = CONGESTION[block]
        reliability = zenoh.Reliability.RELIABLE if reliable else zenoh.Reliability.BEST_EFFORT
        with mapped(f"publish on '{key}'"):
            if not cache:
                plain = self._raw.declare_publisher(
                    key, congestion_control=congestion, reliability=reliability
                )
                return RawPublisher(key, plain)
            keeping = advanced_publisher(
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
