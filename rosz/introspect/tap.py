"""Samples of a topic as they arrive, not decoded, whatever their type: for measuring."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from rosz.node.endpoint import Endpoint
from rosz.qos import DEFAULT
from rosz.wire import Kind, endpoint_key

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.session import Sample

__all__ = ("open_tap",)


def open_tap(
    node: Node, topic: str, type_name: str, type_hash: str, callback: Callable[[Sample], None]
) -> Endpoint:
    """Subscribe to a topic so that every sample is handed over on Zenoh's thread, at full speed.

    It hears all types of the topic. To others it is a subscription like any other.

    Args:
        node: The node that it belongs to, and is closed with.
        topic: Name of the topic.
        type_name: The type that others are told, ``pkg/msg/Name``.
        type_hash: Its hash.
        callback: Gets each sample, on a Zenoh thread; must be short.

    Raises:
        ClosedError: The node is closed.
    """
    tap = Endpoint(node, Kind.SUBSCRIPTION, topic, type_name, type_hash, DEFAULT)
    context = node.context
    every_type = endpoint_key(context.domain, topic, "*", "*")
    tap.also_close(context.session.subscriber(every_type, callback))
    tap.announce(watch=False)
    return node.keep(tap)
