"""Transforms for web pages: each asks for some frames, at a rate and with thresholds.

The names and messages are those of ROS 1's tf2_web_republisher and of its ROS 2 successor.
"""

from __future__ import annotations

import itertools
import math
import threading
import time
from collections.abc import Callable, Sized
from typing import Any

from rosz.actions import ActionlibServer, ActionlibServerGoal
from rosz.errors import TransformError
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rosz.msgs.std_msgs.msg import Header
from rosz.msgs.tf2_web_republisher.action import TFSubscription
from rosz.msgs.tf2_web_republisher.msg import TFArray
from rosz.msgs.tf2_web_republisher.srv import RepublishTFs
from rosz.msgs.tf2_web_republisher_interfaces.action import TFSubscription as Ros2TFSubscription
from rosz.node import Node
from rosz.transforms.buffer import Buffer
from rosz.transforms.poses import Pose
from rosz.transforms.topics import TransformListener
from rosz.wire import Kind

_NAME = "/tf2_web_republisher"
_FEEDBACK = f"{_NAME}/feedback"
_ACTION = "tf2_web_republisher/TFSubscriptionAction"
_SERVICE = "/republish_tfs"
_RATE = 10.0
_FASTEST = 1000.0
_UNHEARD_SECONDS = 10.0


class Republisher:
    """Serve the action ``/tf2_web_republisher`` and the service ``/republish_tfs``.

    Transforms are followed only while somebody asks for some. Closing the node ends it.

    Args:
        node: Node that serves them.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._lock = threading.RLock()
        self._numbers = itertools.count(1)
        self._buffer = Buffer()
        self._listener: TransformListener | None = None
        self._streams: dict[str, _Stream] = {}
        followed = node.context.graph.follow_entities(Kind.SUBSCRIPTION, _FEEDBACK)
        self._feedback = node.keep(followed)
        # The states of goals are published when they change, as web pages do not need them.
        server = ActionlibServer(
            node,
            _NAME,
            node.context.types.message(_ACTION),
            self._begin,
            self._cancel,
            status_frequency=0,
            has_ros2=False,
        )
        server.status_timeout, server.queue_size = 0, 100
        server.start()
        node.service(_SERVICE, RepublishTFs, self._republish)
        node.action_server(_NAME, Ros2TFSubscription, self._execute)

    @staticmethod
    def is_served(node: Node) -> bool:
        """Return whether a node serves the action already."""
        view = node.context.graph.refresh()
        goals = view.subscriptions(f"{_NAME}/goal")
        return bool(goals) or bool(view.servers(_SERVICE))

    # Streams of transforms.

    def _start(
        self, key: str, request: Any, send: Callable[[list[Any]], None], ended: Callable[[], bool]
    ) -> None:
        """Send the transforms of a request when they have changed, until nobody wants them.

        An older stream of the key ends.
        """
        stream = _Stream(self._buffer, request, send)
        with self._lock:
            self._streams[key] = stream
            if self._listener is None:
                self._listener = TransformListener(self._buffer, self._node)

        def look(_event: Any) -> None:
            if self._streams.get(key) is not stream:
                timer.close()
            elif ended():
                self._stop(key)
            else:
                stream.look()

        rate = request.rate if 0 < request.rate <= _FASTEST else _RATE
        timer = self._node.timer(1 / rate, look)

    def _stop(self, key: str) -> None:
        with self._lock:
            self._streams.pop(key, None)
            if self._listener is not None and not self._streams:
                self._listener.close()
                self._listener = None
                self._buffer.clear()

    def _unheard(
        self, subscribers: Callable[[], Sized], seconds: float = _UNHEARD_SECONDS
    ) -> Callable[[], bool]:
        """Return a function that tells whether a topic has had no subscribers for some time."""
        heard = [time.monotonic()]

        def unheard() -> bool:
            if len(subscribers()):
                heard[0] = time.monotonic()
            return time.monotonic() - heard[0] > seconds

        return unheard

    # ROS 1's action.

    def _begin(self, goal: ActionlibServerGoal) -> None:
        unheard = self._unheard(lambda: self._feedback.view().subscriptions(_FEEDBACK))

        def send(transforms: list[Any]) -> None:
            goal.publish_feedback(TFSubscription.Feedback(transforms))

        def ended() -> bool:
            if unheard():
                goal.cancel()
                return True
            return False

        goal.accept()
        self._start(f"goal {goal.id.id}", goal.message.goal, send, ended)

    def _cancel(self, goal: ActionlibServerGoal) -> None:
        self._stop(f"goal {goal.id.id}")
        goal.cancel()

    # The service, and ROS 2's action.

    def _republish(self, request: Any) -> Any:
        topic = f"/tf_repub_{next(self._numbers)}"
        publisher = self._node.publisher(topic, TFArray, latch=True)
        seconds = request.timeout.to_nsec() / 1e9 or _UNHEARD_SECONDS
        unheard = self._unheard(publisher.subscribers, seconds)

        def ended() -> bool:
            if unheard():
                publisher.close()
                return True
            return False

        self._start(
            topic, request, lambda transforms: publisher.publish(TFArray(transforms)), ended
        )
        return RepublishTFs.Response(topic)

    def _execute(self, goal: Any) -> None:
        key = f"ros2 {goal.id}"

        def send(transforms: list[Any]) -> None:
            goal.feedback(Ros2TFSubscription.Feedback(transforms))

        self._start(key, goal.request, send, lambda: goal.cancel_requested)
        goal.wait_for_cancel(threading.TIMEOUT_MAX)
        self._stop(key)
        if not goal.done:
            goal.canceled()


class _Stream:
    """The transforms of one request, and those of them that were sent."""

    def __init__(self, buffer: Buffer, request: Any, send: Callable[[list[Any]], None]) -> None:
        self._buffer = buffer
        self._target = request.target_frame.lstrip("/")
        self._sources = [frame.lstrip("/") for frame in request.source_frames]
        self._angle: float = request.angular_thres
        self._distance: float = request.trans_thres
        self._send = send
        self._sent: dict[str, Pose] = {}

    def look(self) -> None:
        """Send the transforms that have changed."""
        changed = []
        for source in self._sources:
            try:
                pose, stamp = self._buffer.lookup(self._target, source)
            except TransformError:
                continue  # not known yet, or not any more
            before = self._sent.get(source)
            if before is None or self._differs(before, pose):
                self._sent[source] = pose
                header = Header(stamp=Time.from_nsec(stamp), frame_id=self._target)
                transform = Transform(Vector3(*pose[0]), Quaternion(*pose[1]))
                changed.append(TransformStamped(header, source, transform))
        if changed:
            self._send(changed)

    def _differs(self, before: Pose, now: Pose) -> bool:
        if math.dist(before[0], now[0]) > self._distance:
            return True
        cosine: float = abs(sum(a * b for a, b in zip(before[1], now[1], strict=True)))
        angle: float = 2 * math.acos(min(1.0, cosine))
        return angle > self._angle
