"""tf2_ros.buffer: the transforms of the last seconds, and waiting for others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rosz.msgs.geometry_msgs.msg import TransformStamped
from rosz.msgs.tf2_msgs.srv import FrameGraph, FrameGraphResponse
from rosz.node import Clock, Node
from rosz.ros1 import rospy, state
from rosz.ros1.tf2_py import BufferCore, nanoseconds
from rosz.ros1.tf2_ros.buffer_interface import BufferInterface

__all__ = ("Buffer",)

_FRAMES = "~tf2_frames"


class Buffer(BufferCore, BufferInterface):
    """A buffer of the transforms of the last seconds.

    Args:
        cache_time: Age up to which transforms are kept; ten seconds when not given.
        debug: Whether the node serves the state of the frames, as ``~tf2_frames``; the first such
            buffer of the node does.

    Attributes:
        clock: Clock to wait by; that of the node of the listener.
    """

    def __init__(self, cache_time: Any = None, debug: bool = True) -> None:
        super().__init__(cache_time)
        self.clock: Clock = Clock()
        if debug:
            state.when_ready(self._serve)

    def _serve(self, node: Node) -> None:
        if node.resolve(_FRAMES) not in state.state.services:
            self.frame_server = rospy.Service(_FRAMES, FrameGraph, self._respond)

    def _respond(self, _request: Any) -> FrameGraphResponse:
        return FrameGraphResponse(self.all_frames_as_yaml())

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = None
    ) -> TransformStamped:
        """Return the transform from the source frame to the target frame."""
        call = target_frame, source_frame, time
        self._wait(lambda: self.can_transform_core(*call)[0], timeout)
        return self.lookup_transform_core(*call)

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
        call = target_frame, target_time, source_frame, source_time, fixed_frame
        self._wait(lambda: self.can_transform_full_core(*call)[0], timeout)
        return self.lookup_transform_full_core(*call)

    def can_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: Any,
        timeout: Any = None,
        return_debug_tuple: bool = False,
    ) -> Any:
        """Return whether a transform is known.

        Args:
            target_frame: Frame to transform coordinates to.
            source_frame: Frame of the coordinates.
            time: Time of the transform; 0 for the latest.
            timeout: Longest time to wait for the transform.
            return_debug_tuple: Whether to return a tuple with the reason as well.
        """
        call = target_frame, source_frame, time
        self._wait(lambda: self.can_transform_core(*call)[0], timeout)
        found = self.can_transform_core(*call)
        return found if return_debug_tuple else found[0]

    def can_transform_full(  # noqa: PLR0917  # ROS 1's
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = None,
        return_debug_tuple: bool = False,
    ) -> Any:
        """Return whether a transform between two times is known.

        Args:
            target_frame: Frame to transform coordinates to.
            target_time: Time of the target frame.
            source_frame: Frame of the coordinates.
            source_time: Time of the source frame.
            fixed_frame: Frame that does not move meanwhile.
            timeout: Longest time to wait for the transform.
            return_debug_tuple: Whether to return a tuple with the reason as well.
        """
        call = target_frame, target_time, source_frame, source_time, fixed_frame
        self._wait(lambda: self.can_transform_full_core(*call)[0], timeout)
        found = self.can_transform_full_core(*call)
        return found if return_debug_tuple else found[0]

    def _wait(self, known: Callable[[], bool], timeout: Any) -> None:
        if timeout is not None and nanoseconds(timeout) > 0:
            self.frames.wait(known, nanoseconds(timeout), self.clock)
