"""Publishers with a cache and the subscribers that ask it: zenoh-ext's, set as rmw_zenoh does."""

from __future__ import annotations

from typing import Any

import zenoh
import zenoh.ext

__all__ = ("advanced_publisher", "advanced_subscriber")

_HEARTBEAT_SECONDS = 0.5


def advanced_publisher(raw: Any, key: str, cache: int, **qos: Any) -> Any:
    """Declare a publisher that keeps its newest samples for late joiners.

    Args:
        raw: Zenoh's session.
        key: Key expression.
        cache: Samples kept.
        qos: Zenoh's ``congestion_control`` and ``reliability``.
    """
    # Both arguments have to be given.
    heartbeat = zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=_HEARTBEAT_SECONDS)
    return zenoh.ext.declare_advanced_publisher(
        raw,
        key,
        cache=zenoh.ext.CacheConfig(cache),
        publisher_detection=True,
        sample_miss_detection=heartbeat
        if qos.get("reliability") == zenoh.Reliability.RELIABLE
        else None,
        **qos,
    )


def advanced_subscriber(raw: Any, key: str, handler: Any, history: int, **options: Any) -> Any:
    """Declare a subscriber that asks the caches of publishers.

    Args:
        raw: Zenoh's session.
        key: Key expression.
        handler: A channel: a callback would run with a lock held that the end needs, too.
        history: Samples per publisher to ask for.
        options: Zenoh's ``allowed_origin``; ``recover`` to notice and fetch what was missed.
    """
    recovery = zenoh.ext.RecoveryConfig(heartbeat=True, periodic_queries=None)
    return zenoh.ext.declare_advanced_subscriber(
        raw,
        key,
        handler,
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=history),
        recovery=recovery if options.pop("recover") else None,
        subscriber_detection=True,
        **options,
    )
