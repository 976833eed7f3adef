"""tf2_ros: transforms between coordinate frames (ROS wiki, tf2_ros).

Beside the exports there is what looks up transforms in another node's buffer.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from rosz.errors import RoszError
from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.msgs.geometry_msgs.msg import TransformStamped
from rosz.msgs.tf2_msgs.msg import TF2Error, TFMessage
from rosz.ros1.client import rospy, tf2_py
from rosz.ros1.client.actionlib import ActionServer, ServerGoalHandle, SimpleActionClient
from rosz.ros1.client.tf2_py import *  # noqa: F403
from rosz.ros1.client.tf2_ros import buffer_interface
from rosz.ros1.client.tf2_ros.buffer import (
    Buffer,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformListener,
)
from rosz.ros1.client.tf2_ros.buffer_interface import *  # noqa: F403
from rosz.ros1.client.tf2_ros.buffer_interface import BufferInterface
from rosz.worker import Worker

__all__: tuple[str, ...] = (
    "Buffer",
    "BufferClient",
    "BufferServer",
    "StaticTransformBroadcaster",
    "TFMessage",
    "TransformBroadcaster",
    "TransformListener",
    "TransformStamped",
)
__all__ += tf2_py.__all__ + buffer_interface.__all__

_PADDING_SECONDS = 2
_ERRORS: dict[int, type[tf2_py.TransformException]] = {
    TF2Error.LOOKUP_ERROR: tf2_py.LookupException,
    TF2Error.CONNECTIVITY_ERROR: tf2_py.ConnectivityException,
    TF2Error.EXTRAPOLATION_ERROR: tf2_py.ExtrapolationException,
    TF2Error.INVALID_ARGUMENT_ERROR: tf2_py.InvalidArgumentException,
    TF2Error.TIMEOUT_ERROR: tf2_py.TimeoutException,
}


class BufferClient(BufferInterface):
    """A buffer that asks a `BufferServer`.

    Args:
        ns: Name of the action of the server.
        check_frequency: Not used.
        timeout_padding: Duration to wait for the server in addition to time limits; 2 s when not
            given.

    Attributes:
        client: Client of the action.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
    """

    def __init__(
        self,
        ns: str,
        check_frequency: float | None = None,  # noqa: ARG002  # ROS 1's
        timeout_padding: Any = None,
    ) -> None:
        messages = import_module("tf2_msgs.msg")
        self._goal: type[Any] = messages.LookupTransformGoal
        self.client = SimpleActionClient(ns, messages.LookupTransformAction)
        self.timeout_padding: Any = timeout_padding or rospy.Duration(_PADDING_SECONDS)

    def wait_for_server(self, timeout: Any = None) -> bool:
        """Wait until the server is connected; see `actionlib.SimpleActionClient`."""
        return self.client.wait_for_server(timeout)

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = None
    ) -> TransformStamped:
        """Return the transform from the source frame to the target frame."""
        return self._query(
            timeout, target_frame=target_frame, source_frame=source_frame, source_time=time
        )

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = None,
    ) -> TransformStamped:
        """Return the transform from a frame at one time to a frame at another time."""
        return self._query(
            timeout,
            target_frame=target_frame,
            target_time=target_time,
            source_frame=source_frame,
            source_time=source_time,
            fixed_frame=fixed_frame,
            advanced=True,
        )

    def can_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = None
    ) -> bool:
        """Return whether a transform is known."""
        try:
            self.lookup_transform(target_frame, source_frame, time, timeout)
        except tf2_py.TransformException:
            return False
        return True

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = None,
    ) -> bool:
        """Return whether a transform between two times is known."""
        call = target_frame, target_time, source_frame, source_time, fixed_frame, timeout
        try:
            self.lookup_transform_full(*call)
        except tf2_py.TransformException:
            return False
        return True

    def _query(self, timeout: Any, **fields: Any) -> TransformStamped:
        goal = self._goal(timeout=timeout or rospy.Duration(0), **fields)
        self.client.send_goal(goal)
        if not self.client.wait_for_result(goal.timeout + self.timeout_padding):
            raise tf2_py.TimeoutException(
                f"buffer server '{self.client.ns}' did not answer in time"
            )
        status = self.client.get_state()
        if status != GoalStatus.SUCCEEDED:
            raise tf2_py.TimeoutException(
                f"buffer server '{self.client.ns}' ended the lookup with status {status}"
            )
        result = self.client.get_result()
        if result.error.error != TF2Error.NO_ERROR:
            kind = _ERRORS.get(result.error.error, tf2_py.TransformException)
            raise kind(result.error.error_string)
        transform: TransformStamped = result.transform
        return transform


_THREADS = 16
"""Lookups that wait at once."""

_NUMBERS: dict[type[RoszError], int] = {kind: number for number, kind in _ERRORS.items()}


class BufferServer:
    """An action server that looks up transforms for every `BufferClient`.

    Args:
        buffer: Buffer to look them up in.
        ns: Name of the action.
        auto_start: Whether the server starts at once, and not with `start`.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
    """

    def __init__(self, buffer: Buffer, ns: str, auto_start: bool = True) -> None:
        messages = import_module("tf2_msgs.msg")
        self._buffer = buffer
        self._result: type[Any] = messages.LookupTransformResult
        self._worker: Worker[ServerGoalHandle] = Worker(
            f"rosz-buffer-server-{ns}", self._answer, threads=_THREADS
        )
        self._server = ActionServer(
            ns, messages.LookupTransformAction, self._accept, self._cancel, auto_start
        )

    def start(self) -> None:
        """Begin to answer."""
        self._server.start()

    def _accept(self, handle: ServerGoalHandle) -> None:
        handle.set_accepted()
        self._worker.submit(handle)

    def _cancel(self, handle: ServerGoalHandle) -> None:
        handle.set_canceled()

    def _answer(self, handle: ServerGoalHandle) -> None:
        result = self._result()
        try:
            result.transform = self._look_up(handle.get_goal())
        except tf2_py.TransformException as error:
            number = _NUMBERS.get(type(error), TF2Error.TRANSFORM_ERROR)
            result.error = TF2Error(number, str(error))
        with self._server.lock:
            if not handle.ended_at:  # else it was cancelled meanwhile
                handle.set_succeeded(result)

    def _look_up(self, goal: Any) -> Any:
        target, source, timeout = goal.target_frame, goal.source_frame, goal.timeout
        if not goal.advanced:
            return self._buffer.lookup_transform(target, source, goal.source_time, timeout)
        return self._buffer.lookup_transform_full(
            target, goal.target_time, source, goal.source_time, goal.fixed_frame, timeout
        )
