"""tf2_ros.buffer_client: looking up transforms in the buffer of another node."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.msgs.geometry_msgs.msg import TransformStamped
from rosz.msgs.tf2_msgs.msg import TF2Error
from rosz.ros1 import rospy
from rosz.ros1.actionlib import SimpleActionClient
from rosz.ros1.tf2_py import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from rosz.ros1.tf2_ros.buffer_interface import BufferInterface

__all__ = ("BufferClient",)

_PADDING_SECONDS = 2
_ERRORS: dict[int, type[TransformException]] = {
    TF2Error.LOOKUP_ERROR: LookupException,
    TF2Error.CONNECTIVITY_ERROR: ConnectivityException,
    TF2Error.EXTRAPOLATION_ERROR: ExtrapolationException,
    TF2Error.INVALID_ARGUMENT_ERROR: InvalidArgumentException,
    TF2Error.TIMEOUT_ERROR: TimeoutException,
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
        timeout_padding: As given.

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
        """Wait until the server is connected.

        Args:
            timeout: Longest time to wait; no limit when not given or 0.

        Returns:
            Whether it is.
        """
        return self.client.wait_for_server(timeout)

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = None
    ) -> TransformStamped:
        """Return the transform from the source frame to the target frame."""
        return self._query(
            target_frame=target_frame,
            source_frame=source_frame,
            source_time=time,
            timeout=timeout or rospy.Duration(0),
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
            target_frame=target_frame,
            target_time=target_time,
            source_frame=source_frame,
            source_time=source_time,
            fixed_frame=fixed_frame,
            timeout=timeout or rospy.Duration(0),
            advanced=True,
        )

    def can_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = None
    ) -> bool:
        """Return whether a transform is known."""
        try:
            self.lookup_transform(target_frame, source_frame, time, timeout)
        except TransformException:
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
        except TransformException:
            return False
        return True

    def _query(self, **fields: Any) -> TransformStamped:
        goal = self._goal(**fields)
        self.client.send_goal(goal)
        if not self.client.wait_for_result(goal.timeout + self.timeout_padding):
            raise TimeoutException(f"buffer server '{self.client.ns}' did not answer in time")
        status = self.client.get_state()
        if status != GoalStatus.SUCCEEDED:
            raise TimeoutException(
                f"buffer server '{self.client.ns}' ended the lookup with status {status}"
            )
        result = self.client.get_result()
        if result.error.error != TF2Error.NO_ERROR:
            kind = _ERRORS.get(result.error.error, TransformException)
            raise kind(result.error.error_string)
        found: TransformStamped = result.transform
        return found
