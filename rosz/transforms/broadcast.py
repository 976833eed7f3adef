"""Telling others of transforms."""

from __future__ import annotations

from collections.abc import Iterable
from copy import deepcopy
from typing import Any

from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.node import Node
from rosz.qos import QoS

__all__ = ("StaticTransformBroadcaster", "TransformBroadcaster")

_QUEUE = QoS(depth=100)
_STATIC = QoS(depth=1, durability="transient_local")


def _listed(transform: Any) -> list[Any]:
    return list(transform) if isinstance(transform, Iterable) else [transform]


class TransformBroadcaster:
    """Tells of frames that move, on ``/tf``.

    Args:
        node: Who tells.
    """

    def __init__(self, node: Node) -> None:
        self._publisher = node.publisher("/tf", TFMessage, qos=_QUEUE)

    def send(self, transform: Any) -> None:
        """Tell of a TransformStamped, or of several."""
        self._publisher.publish(TFMessage(_listed(transform)))


class StaticTransformBroadcaster:
    """Tells of frames that do not move, on ``/tf_static``, whoever comes later, too.

    Args:
        node: Who tells.
    """

    def __init__(self, node: Node) -> None:
        self._told: dict[str, Any] = {}
        self._publisher = node.publisher("/tf_static", TFMessage, qos=_STATIC)

    def send(self, transform: Any) -> None:
        """Tell of a TransformStamped, or of several, and of all that were told before."""
        for one in _listed(transform):
            self._told[one.child_frame_id] = deepcopy(one)  # the caller may fill it anew
        self._publisher.publish(TFMessage(list(self._told.values())))
