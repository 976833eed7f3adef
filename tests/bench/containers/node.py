"""A node of the benchmark: ``node.py (pour|hear) LIBRARY KIND``.

``pour`` publishes as fast as it goes, ``hear`` prints the messages per second that come to its
callback, and ends the process.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import rosz
from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.sensor_msgs.msg import Image, LaserScan

_SECONDS = 1.0
_CALM = 0.3
_QUEUE = 1000
_BEAMS = 360
_MEGABYTE = 1_000_000


def open_node(
    library: str, name: str, kind: type[Any]
) -> tuple[Callable[[], Callable[[Any], None]], Callable[[Callable[[Any], None]], object]]:
    """Return functions that make a publisher's ``publish``, and a subscription."""
    if library == "rospy":
        import rospy  # type: ignore[import-untyped, import-not-found, unused-ignore]

        rospy.init_node(name)
        return (
            lambda: rospy.Publisher("flood", kind, queue_size=1).publish,
            lambda callback: rospy.Subscriber("flood", kind, callback, queue_size=_QUEUE),
        )
    node = rosz.Node(name)

    def publisher() -> Callable[[Any], None]:
        made = node.publisher("flood", kind, queue_size=1, copies=library == "rosz-copies")
        made.wait_for_subscribers()
        return made.publish

    return publisher, lambda callback: node.subscription("flood", kind, callback, queue_size=_QUEUE)


def main(role: str, library: str, kind_name: str) -> None:
    kind: Any = {"Twist": Twist, "LaserScan": LaserScan, "Image": Image}[kind_name]
    publisher, subscribe = open_node(library, role, kind)
    if role == "pour":
        message, publish = kind(), publisher()
        if kind is Image:
            message.data = bytes(_MEGABYTE)
        elif kind is LaserScan:
            message.ranges = message.intensities = [1.5] * _BEAMS
        while True:
            for _ in range(10):
                publish(message)
    came, heard = threading.Event(), 0

    def count(_: object) -> None:
        nonlocal heard
        heard += 1
        if heard == 1:
            came.set()

    subscription = subscribe(count)
    came.wait(30)
    time.sleep(_CALM)
    before, began = heard, time.perf_counter()
    time.sleep(_SECONDS)
    print("rate", (heard - before) / (time.perf_counter() - began), flush=True)
    assert subscription is not None
    os._exit(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
