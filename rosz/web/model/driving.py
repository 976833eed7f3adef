"""Driving by hand: velocities on a topic, as long as the browser says that it is there."""

from __future__ import annotations

import threading
import time

from rosz.access import PagePolicy
from rosz.msgs.geometry_msgs.msg import Twist, Vector3
from rosz.node import Node
from rosz.worker import Worker, run_task

DEAD_MAN_SECONDS = 0.6
"""Seconds without a sign of life after which it stops."""
_PERIOD = 0.1


class VelocityPublisher:
    """Publishes velocities ten times per second while it drives, and zero once when it stops.

    Args:
        node: The node that publishes.
        permission: The changes that the page may make.
        topic: Full name of the topic.

    Raises:
        UsageError: The page may not publish it.
        InvalidName: The name is not legal.
    """

    def __init__(self, node: Node, permission: PagePolicy, topic: str) -> None:
        permission.check("publish", node.resolve(topic))
        self.topic = node.resolve(topic)
        self._publisher = node.publisher(topic, Twist, queue_size=1)
        self._worker = Worker("rosz-web-drive", run_task)
        self._lock = threading.Lock()
        self._velocity = (0.0, 0.0)
        self._driving = False
        self._alive = 0.0

    def alive(self) -> None:
        """Note that the browser is there."""
        self._alive = time.monotonic()

    def drive(self, forward: float, turn: float) -> None:
        """Drive at a speed in m/s, and turn to the left at a rate in rad/s; zero for both stops."""
        with self._lock:
            self.alive()
            self._velocity = (forward, turn)
            start = not self._driving and any(self._velocity)
            self._driving = self._driving or start
        if start:
            self._worker.submit(self._turn)

    def _turn(self) -> None:
        with self._lock:
            gone = time.monotonic() - self._alive > DEAD_MAN_SECONDS
            velocity = (0.0, 0.0) if gone else self._velocity
            self._velocity = velocity
            self._driving = any(velocity)
        forward, turn = velocity
        self._publisher.publish(Twist(linear=Vector3(x=forward), angular=Vector3(z=turn)))
        if self._driving:
            self._worker.later(_PERIOD, self._turn)

    def close(self) -> None:
        """Stop."""
        with self._lock:
            driving, self._driving = self._driving, False
            self._velocity = (0.0, 0.0)
        self._worker.close()
        if driving:
            self._publisher.publish(Twist())
        self._publisher.close()
