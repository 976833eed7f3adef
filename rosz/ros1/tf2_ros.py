"""tf2_ros: transforms between coordinate frames (ROS wiki, tf2_ros).

``BufferClient`` and ``BufferServer`` are not there.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rosz.errors import ExtrapolationNeeded as ExtrapolationException
from rosz.errors import FrameNotFound as LookupException
from rosz.errors import FramesNotConnected as ConnectivityException
from rosz.errors import TransformArgument as InvalidArgumentException
from rosz.errors import TransformError as TransformException
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rosz.msgs.std_msgs.msg import Header
from rosz.node import Node
from rosz.ros1 import state, tf2_geometry_msgs
from rosz.transforms import Buffer as Frames
from rosz.transforms import Pose, pose_of
from rosz.transforms import StaticTransformBroadcaster as _StaticBroadcaster
from rosz.transforms import TransformBroadcaster as _Broadcaster
from rosz.transforms import TransformListener as _Listener

__all__ = (
    "Buffer",
    "BufferInterface",
    "ConnectivityException",
    "ExtrapolationException",
    "InvalidArgumentException",
    "LookupException",
    "StaticTransformBroadcaster",
    "TimeoutException",
    "TransformBroadcaster",
    "TransformException",
    "TransformListener",
    "TypeException",
)

_TEN_SECONDS = 10 * 10**9


class TimeoutException(TransformException):
    """A transform did not become known in time."""


class TypeException(TransformException):
    """Messages of the type cannot be transformed."""


def _ns(value: Any) -> int:
    """Return a time or duration of rospy or rclpy, or seconds, as nanoseconds."""
    if hasattr(value, "nanoseconds"):
        return int(value.nanoseconds)
    return value.to_nsec() if hasattr(value, "to_nsec") else round(float(value or 0) * 1e9)


def _node_of(node: Any) -> Node:
    """Return rosz's node of an rclpy node, or the node of the process."""
    given: Node | None = getattr(node, "rosz_node", None)
    return state.node() if given is None else given


class BufferInterface:
    """Base class of objects that look up transforms."""

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = None
    ) -> TransformStamped:
        """Return the transform from the source frame to the target frame.

        Args:
            target_frame: Frame to transform coordinates to.
            source_frame: Frame of the coordinates.
            time: Time of the transform; 0 for the latest.
            timeout: Longest time to wait for the transform; no wait when not given.

        Raises:
            TransformException: The transform is not known; the subclass tells the reason.
        """
        raise NotImplementedError

    def transform(
        self, object_stamped: Any, target_frame: str, timeout: Any = None, new_type: Any = None
    ) -> Any:
        """Transform a stamped point, pose, vector or wrench to another frame.

        Args:
            object_stamped: Message to transform.
            target_frame: Frame to transform the message to.
            timeout: Longest time to wait for the transform.
            new_type: Not supported; results have the type of the message.

        Raises:
            TypeException: Messages of the type cannot be transformed.
            TransformException: The transform is not known.
        """
        act = tf2_geometry_msgs.transformation_of(object_stamped)
        if act is None or new_type is not None:
            raise TypeException(
                f"cannot transform {type(object_stamped).__name__}; expected PointStamped,"
                " PoseStamped, Vector3Stamped or WrenchStamped of geometry_msgs"
            )
        header = object_stamped.header
        found = self.lookup_transform(target_frame, header.frame_id, header.stamp, timeout)
        return act(object_stamped, found)


class Buffer(BufferInterface):
    """A buffer of the transforms of the last seconds.

    Args:
        cache_time: Age up to which transforms are kept; ten seconds when not given.
        debug: Not used; the service ``tf2_frames`` is missing.
    """

    def __init__(self, cache_time: Any = None, debug: bool = True) -> None:  # noqa: ARG002
        self.frames: Frames = Frames(_TEN_SECONDS if cache_time is None else _ns(cache_time))
        self.now: Callable[[], int] = time.time_ns

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        """Add a transform."""
        self._set(transform, authority, static=False)

    def set_transform_static(self, transform: TransformStamped, authority: str) -> None:
        """Add a static transform."""
        self._set(transform, authority, static=True)

    def _set(self, transform: TransformStamped, authority: str, *, static: bool) -> None:
        self.frames.set(
            transform.header.frame_id,
            transform.child_frame_id,
            _ns(transform.header.stamp),
            pose_of(transform.transform),
            static=static,
            authority=authority,
        )

    def clear(self) -> None:
        """Remove all transforms but the static ones."""
        self.frames.clear()

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = None
    ) -> TransformStamped:
        """Return the transform from the source frame to the target frame."""
        self.can_transform(target_frame, source_frame, time, timeout)
        return self.lookup_transform_core(target_frame, source_frame, time)

    def lookup_transform_core(
        self, target_frame: str, source_frame: str, time: Any
    ) -> TransformStamped:
        """Return the transform from the source to the target frame without waiting."""
        pose, stamp = self.frames.lookup(target_frame, source_frame, _ns(time))
        return _stamped(target_frame, source_frame, pose, stamp)

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        *waiting: Any,
    ) -> TransformStamped:
        """Return the transform from a frame at one time to a frame at another time.

        Args:
            target_frame: Frame to transform coordinates to.
            target_time: Time of the target frame.
            source_frame: Frame of the coordinates.
            source_time: Time of the source frame.
            fixed_frame: Frame that does not move meanwhile.
            waiting: Longest time to wait for the transform.

        Raises:
            TransformException: The transform is not known; the subclass tells the reason.
        """
        call = target_frame, _ns(target_time), source_frame, _ns(source_time), fixed_frame
        self._wait(lambda: not self._why_not_full(*call), *waiting)
        pose, stamp = self.frames.lookup_full(*call)
        return _stamped(target_frame, source_frame, pose, stamp)

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
        stamp = _ns(time)
        self._wait(lambda: not self.frames.why_not(target_frame, source_frame, stamp), timeout)
        reason = self.frames.why_not(target_frame, source_frame, stamp)
        return (not reason, reason) if return_debug_tuple else not reason

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        *waiting: Any,
    ) -> bool:
        """Return whether a transform between two times is known; see `lookup_transform_full`."""
        call = target_frame, _ns(target_time), source_frame, _ns(source_time), fixed_frame
        self._wait(lambda: not self._why_not_full(*call), *waiting)
        return not self._why_not_full(*call)

    def _why_not_full(self, *call: Any) -> str:
        try:
            self.frames.lookup_full(*call)
        except TransformException as error:
            return str(error) or "unknown"
        return ""

    def _wait(self, known: Callable[[], bool], timeout: Any = None) -> None:
        if timeout is not None and _ns(timeout) > 0 and not known():
            self.frames.wait(known, _ns(timeout), self.now)

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Any:
        """Return the latest time at which a transform is known."""
        return Time.from_nsec(self.frames.latest_common(target_frame, source_frame))

    def all_frames_as_string(self) -> str:
        """Return the parent of each frame, one per line."""
        return "".join(
            f"Frame {name} exists with parent {one.newest.parent}.\n"
            for name, one in self.frames.histories().items()
        )

    def all_frames_as_yaml(self) -> str:
        """Return the state of each frame as YAML."""
        return "".join(
            f"{name}: \n  parent: '{one.newest.parent}'\n  broadcaster: '{one.authority}'\n"
            f"  rate: {one.rate:.3f}\n  most_recent_transform: {one.latest / 1e9:.3f}\n"
            f"  oldest_transform: {one.oldest / 1e9:.3f}\n"
            f"  buffer_length: {(one.latest - one.oldest) / 1e9:.3f}\n"
            for name, one in self.frames.histories().items()
        )


def _stamped(target: str, source: str, pose: Pose, stamp: int) -> TransformStamped:
    header = Header(stamp=Time.from_nsec(stamp), frame_id=target)
    transform = Transform(Vector3(*pose.translation), Quaternion(*pose.rotation))
    return TransformStamped(header, source, transform)


class TransformListener:
    """Receive transforms and put them into a buffer.

    Args:
        buffer: Buffer to fill.
        node: An rclpy node; the node of the process when not given. The options of rospy are
            ignored.
    """

    def __init__(self, buffer: Buffer, node: Any = None, **_options: Any) -> None:
        self.buffer: Buffer = buffer
        listening = _node_of(node)
        buffer.now = listening.now
        self._listener = _Listener(buffer.frames, listening)

    def unregister(self) -> None:
        """Close the subscriptions."""
        self._listener.close()


class TransformBroadcaster:
    """Publish transforms of moving frames.

    Args:
        node: An rclpy node; the node of the process when not given.
    """

    def __init__(self, node: Any = None) -> None:
        self._broadcaster = _Broadcaster(_node_of(node))

    def sendTransform(self, transform: Any) -> None:  # noqa: N802  # ROS 1's
        """Publish one TransformStamped or several."""
        self._broadcaster.send(transform)


class StaticTransformBroadcaster:
    """Publish transforms of static frames, also to late subscriptions.

    Args:
        node: An rclpy node; the node of the process when not given.
    """

    def __init__(self, node: Any = None) -> None:
        self._broadcaster = _StaticBroadcaster(_node_of(node))

    def sendTransform(self, transform: Any) -> None:  # noqa: N802  # ROS 1's
        """Publish one TransformStamped or several."""
        self._broadcaster.send(transform)
