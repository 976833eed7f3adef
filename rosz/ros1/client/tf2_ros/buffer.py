"""tf2_ros: the buffer of the transforms of the last seconds, and the topics that fill it."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from rosz import transforms
from rosz.msgs.geometry_msgs.msg import TransformStamped
from rosz.msgs.tf2_msgs.srv import FrameGraph, FrameGraphResponse
from rosz.node import Clock, Node
from rosz.ros1 import state
from rosz.ros1.client import rospy
from rosz.ros1.client.tf2_py import BufferCore, nanoseconds
from rosz.ros1.client.tf2_ros.buffer_interface import BufferInterface

__all__ = ("Buffer",)

_FRAMES = "~tf2_frames"


class Buffer(BufferCore, BufferInterface):
    """A buffer of the transforms of the last seconds.

    Args:
        cache_time: Age up to which transforms are kept; ten seconds when not given.
        debug: Whether the node serves the state of the frames, as ``~tf2_frames``; the first such
            buffer of the node does.
        node: Not used: the listener has the node.

    Attributes:
        clock: Clock to wait by; that of the node of the listener.
    """

    def __init__(self, cache_time: Any = None, debug: Any = True, *, node: Any = None) -> None:  # noqa: ARG002  # ROS 2's
        super().__init__(cache_time)
        self.clock: Clock = Clock()
        if debug:
            state.when_ready(self._serve)

    def _serve(self, node: Node) -> None:
        if node.resolve(_FRAMES) not in state.state.services:
            self.frame_server = rospy.Service(
                _FRAMES, FrameGraph, lambda _: FrameGraphResponse(self.all_frames_as_yaml())
            )

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
        """Return whether a transform is known; see `lookup_transform`.

        With ``return_debug_tuple`` it is a tuple with the reason as well.
        """
        call = target_frame, source_frame, time
        self._wait(lambda: self.can_transform_core(*call)[0], timeout)
        answer = self.can_transform_core(*call)
        return answer if return_debug_tuple else answer[0]

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
        """Return whether a transform between two times is known; see `can_transform`."""
        call = target_frame, target_time, source_frame, source_time, fixed_frame
        self._wait(lambda: self.can_transform_full_core(*call)[0], timeout)
        answer = self.can_transform_full_core(*call)
        return answer if return_debug_tuple else answer[0]

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: Any) -> Any:
        """Return a future of rclpy that is done when a transform is known."""
        future = import_module("rclpy.task").Future()
        call = target_frame, source_frame, time
        forget = self.frames.when(
            lambda: self.can_transform_core(*call)[0], lambda: future.set_result(True)
        )
        future.add_done_callback(lambda _: forget())
        return future

    async def lookup_transform_async(
        self, target_frame: str, source_frame: str, time: Any
    ) -> TransformStamped:
        """Return a transform when it is known; see `lookup_transform`."""
        await self.wait_for_transform_async(target_frame, source_frame, time)
        return self.lookup_transform_core(target_frame, source_frame, time)

    def _wait(self, condition: Callable[[], bool], timeout: Any) -> None:
        if timeout is not None and nanoseconds(timeout) > 0:
            self.frames.wait(condition, nanoseconds(timeout), self.clock)


def node_of(node: Any) -> Node:
    """Return rosz's node of an rclpy node, or the node of the process."""
    given: Node | None = getattr(node, "rosz_node", None)
    return state.node() if given is None else given


class _Broadcaster:
    """Base class; ``node`` is an rclpy node, or that of the process when not given."""

    _kind: type[Any]

    def __init__(self, node: Any = None) -> None:
        self._broadcaster: Any = None
        if node is None:
            state.when_ready(self._open)
        else:
            self._open(node_of(node))

    def _open(self, node: Node) -> None:
        self._broadcaster = self._kind(node)

    def sendTransform(self, transform: Any) -> None:  # noqa: N802  # ROS 1's
        """Publish one TransformStamped or several.

        Raises:
            ROSInitException: ``rospy.init_node`` was not called.
        """
        if self._broadcaster is None:
            node = state.node()
            if state.is_shutdown():
                return
            self._open(node)
        self._broadcaster.send(transform)


class TransformBroadcaster(_Broadcaster):
    """Publish transforms of moving frames."""

    _kind = transforms.TransformBroadcaster


class StaticTransformBroadcaster(_Broadcaster):
    """Publish transforms of static frames, also to late subscriptions."""

    _kind = transforms.StaticTransformBroadcaster


class TransformListener:
    """Receive transforms and put them into a buffer.

    Args:
        buffer: Buffer to fill.
        node: An rclpy node; the node of the process when not given. The options of rospy are
            ignored.
    """

    def __init__(self, buffer: Buffer, node: Any = None, **_options: Any) -> None:
        self.buffer: Buffer = buffer
        listening = node_of(node)
        buffer.clock = listening.clock
        self._listener = transforms.TransformListener(buffer.frames, listening)

    def unregister(self) -> None:
        """Close the subscriptions."""
        self._listener.close()
