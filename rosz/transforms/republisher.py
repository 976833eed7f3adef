"""Transforms for web pages: each asks for some frames, at a rate and with thresholds.

The names and messages are those of ROS 1's tf2_web_republisher and of its ROS 2 successor.
"""

from __future__ import annotations

import itertools
import math
import threading
import time
from collections.abc import Callable
from typing import Any

from rosz.errors import TransformError
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rosz.msgs.std_msgs.msg import Header
from rosz.msgs.tf2_web_republisher.action import TFSubscription
from rosz.msgs.tf2_web_republisher.msg import TFArray
from rosz.msgs.tf2_web_republisher.srv import RepublishTFs
from rosz.msgs.tf2_web_republisher_interfaces.action import TFSubscription as Ros2TFSubscription
from rosz.node import Node, Publisher
from rosz.transforms.buffer import Buffer
from rosz.transforms.poses import Pose
from rosz.transforms.topics import TransformListener

__all__ = ("Republisher",)

_NAME = "/tf2_web_republisher"
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
        message = node.context.types.message
        self._feedback_type: Any = message(f"{_ACTION}Feedback")
        self._feedback = node.publisher(f"{_NAME}/feedback", self._feedback_type, queue_size=100)
        self._result_type: Any = message(f"{_ACTION}Result")
        self._result = node.publisher(f"{_NAME}/result", self._result_type)
        self._status = node.publisher(f"{_NAME}/status", GoalStatusArray, latch=True)
        node.subscription(f"{_NAME}/goal", message(f"{_ACTION}Goal"), self._begin)
        node.subscription(f"{_NAME}/cancel", GoalID, self._cancel)
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
        """Send the transforms that a request is about when they have changed.

        Args:
            key: Name of the stream; an older one of that name ends.
            request: The request or goal.
            send: Function that sends changed transforms.
            ended: Function that tells whether nobody wants them any more.
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

    def _stop(self, key: str) -> bool:
        with self._lock:
            found = self._streams.pop(key, None) is not None
            if self._listener is not None and not self._streams:
                self._listener.close()
                self._listener = None
                self._buffer.clear()
            return found

    def _unheard(self, publisher: Publisher[Any], seconds: float) -> Callable[[], bool]:
        """Return a function that tells whether a topic has had no subscribers for some time."""
        heard = [time.monotonic()]

        def unheard() -> bool:
            if publisher.subscribers():
                heard[0] = time.monotonic()
            return time.monotonic() - heard[0] > seconds

        return unheard

    # ROS 1's action.

    def _begin(self, message: Any) -> None:
        goal_id = message.goal_id
        key = f"goal {goal_id.id}"

        def send(transforms: list[Any]) -> None:
            status = GoalStatus(goal_id, GoalStatus.ACTIVE)
            feedback = TFSubscription.Feedback(transforms)
            self._feedback.publish(self._feedback_type(self._header(), status, feedback))

        self._start(key, message.goal, send, self._unheard(self._feedback, _UNHEARD_SECONDS))
        self._publish_status()

    def _cancel(self, message: Any) -> None:
        keys = [f"goal {message.id}"] if message.id else list(self._streams)
        for key in keys:
            if key.startswith("goal ") and self._stop(key):
                status = GoalStatus(GoalID(Time(), key.removeprefix("goal ")), GoalStatus.PREEMPTED)
                result = self._result_type(self._header(), status, TFSubscription.Result())
                self._result.publish(result)
        self._publish_status()

    def _publish_status(self) -> None:
        goals = [key.removeprefix("goal ") for key in self._streams if key.startswith("goal ")]
        statuses = [GoalStatus(GoalID(Time(), one), GoalStatus.ACTIVE) for one in goals]
        self._status.publish(GoalStatusArray(self._header(), statuses))

    def _header(self) -> Header:
        return Header(stamp=Time.from_nsec(self._node.now()))

    # The service, and ROS 2's action.

    def _republish(self, request: Any) -> Any:
        topic = f"/tf_repub_{next(self._numbers)}"
        publisher = self._node.publisher(topic, TFArray, latch=True)
        seconds = request.timeout.to_nsec() / 1e9 or _UNHEARD_SECONDS
        unheard = self._unheard(publisher, seconds)

        def ended() -> bool:
            if unheard():
                publisher.close()
                return True
            return False

        self._start(topic, request, lambda found: publisher.publish(TFArray(found)), ended)
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
    """The transforms that one request is about, and what was sent of them."""

    def __init__(self, buffer: Buffer, request: Any, send: Callable[[list[Any]], None]) -> None:
        self._buffer = buffer
        self._target = request.target_frame.lstrip("/")
        self._sources = [frame.lstrip("/") for frame in request.source_frames]
        self._angle: float = request.angular_thres
        self._distance: float = request.trans_thres
        self._send = send
        self._sent: dict[str, Pose] = {}

    def look(self) -> None:
        """Send what has changed."""
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
