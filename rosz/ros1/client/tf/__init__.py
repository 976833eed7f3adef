"""tf: transforms between coordinate frames, and the arithmetic of rotations (ROS wiki, tf).

Prefixes of frame names are not supported.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rosz.errors import ExtrapolationNeeded as ExtrapolationException
from rosz.errors import FrameNotFound as LookupException
from rosz.errors import FramesNotConnected as ConnectivityException
from rosz.errors import TransformError as Exception  # noqa: A004  # ROS 1's
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import (
    Point32,
    Pose,
    PoseStamped,
    Quaternion,
    QuaternionStamped,
    Transform,
    TransformStamped,
    Vector3,
)
from rosz.msgs.sensor_msgs.msg import PointCloud
from rosz.msgs.std_msgs.msg import Header
from rosz.ros1.client import tf2_geometry_msgs, tf2_ros
from rosz.ros1.client.tf import transformations
from rosz.ros1.client.tf.transformations import (
    quaternion_inverse,
    quaternion_matrix,
    rotation_from_matrix,
    translation_matrix,
)
from rosz.transforms import IDENTITY, compose, pose_of
from rosz.transforms import Pose as Plain

__all__ = (
    "ConnectivityException",
    "Exception",
    "ExtrapolationException",
    "LookupException",
    "TransformBroadcaster",
    "TransformListener",
    "Transformer",
    "TransformerROS",
    "transformations",
)

Parts = tuple[list[float], list[float]]
"""Translation ``x, y, z`` and rotation ``x, y, z, w``."""

Twist = tuple[tuple[float, ...], tuple[float, ...]]
"""Velocity in m/s and angular velocity in rad/s, each ``x, y, z``."""

_EARLIEST = 100_000
"""Nanoseconds; a stamp of 0 would mean the latest time."""


def _strip(frame: str) -> str:
    return frame.removeprefix("/")


def _stripped(*call: Any) -> tuple[Any, ...]:
    """Return the arguments of a call, the names of frames among them without a slash in front."""
    return tuple(_strip(value) if isinstance(value, str) else value for value in call)


def _parts(stamped: TransformStamped) -> Parts:
    t, r = stamped.transform.translation, stamped.transform.rotation
    return [t.x, t.y, t.z], [r.x, r.y, r.z, r.w]


class Transformer:
    """A buffer of the transforms of the last seconds; ignores leading slashes of frame names.

    Args:
        interpolate: Not used; transforms are always interpolated.
        cache_time: Age up to which transforms are kept; ten seconds when not given.
    """

    def __init__(self, interpolate: bool = True, cache_time: Any = None) -> None:  # noqa: ARG002
        self._buffer = tf2_ros.Buffer(cache_time, debug=False)
        self._using_dedicated_thread = False

    def setTransform(self, transform: Any, authority: str = "default_authority") -> None:  # noqa: N802
        """Add a TransformStamped."""
        self._buffer.set_transform(transform, authority)

    def canTransform(self, target_frame: str, source_frame: str, time: Any) -> bool:  # noqa: N802
        """Return whether a transform is known."""
        return bool(self._buffer.can_transform(_strip(target_frame), _strip(source_frame), time))

    def waitForTransform(  # noqa: N802  # ROS 1's
        self,
        target_frame: str,
        source_frame: str,
        time: Any,
        timeout: Any,
        polling_sleep_duration: Any = None,  # noqa: ARG002  # ROS 1's
    ) -> None:
        """Wait until a transform is known.

        Args:
            target_frame: Frame to transform coordinates to.
            source_frame: Frame of the coordinates.
            time: Time of the transform; 0 for the latest.
            timeout: Longest time to wait.
            polling_sleep_duration: Not used.

        Raises:
            Exception: The transform is not known in time; the text tells the reason.
        """
        call = _stripped(target_frame, source_frame, time, timeout)
        self._wait(self._buffer.can_transform, *call)

    def _wait(self, can_transform: Callable[..., Any], *call: Any) -> None:
        """Call a method that waits for a transform, or raise tf's own exception."""
        if not self._using_dedicated_thread:
            raise Exception("cannot wait for a transform: no listener receives any")
        is_known, reason = can_transform(*call, return_debug_tuple=True)
        if not is_known:
            raise Exception(reason)

    def lookupTransform(self, target_frame: str, source_frame: str, time: Any) -> Parts:  # noqa: N802
        """Return the transform from the source frame to the target frame.

        Raises:
            LookupException: A frame does not exist.
            ConnectivityException: The frames belong to separate trees.
            ExtrapolationException: The time is before or after all known transforms.
        """
        call = _stripped(target_frame, source_frame, time)
        return _parts(self._buffer.lookup_transform(*call))

    def lookupTransformFull(  # noqa: N802  # ROS 1's
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
    ) -> Parts:
        """Return the transform between frames at two times; see `lookupTransform`."""
        call = _stripped(target_frame, target_time, source_frame, source_time, fixed_frame)
        return _parts(self._buffer.lookup_transform_full(*call))

    def getLatestCommonTime(self, source_frame: str, dest_frame: str) -> Any:  # noqa: N802  # ROS 1's
        """Return the latest time at which a transform is known."""
        return self._buffer.get_latest_common_time(_strip(source_frame), _strip(dest_frame))

    def canTransformFull(  # noqa: N802  # ROS 1's
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
    ) -> bool:
        """Return whether a transform between two times is known; see `lookupTransformFull`."""
        call = _stripped(target_frame, target_time, source_frame, source_time, fixed_frame)
        return bool(self._buffer.can_transform_full(*call))

    def waitForTransformFull(  # noqa: N802, PLR0917  # ROS 1's
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any,
        polling_sleep_duration: Any = None,  # noqa: ARG002  # ROS 1's
    ) -> None:
        """Wait until a transform between two times is known; see `waitForTransform`."""
        call = _stripped(target_frame, target_time, source_frame, source_time, fixed_frame)
        self._wait(self._buffer.can_transform_full, *call, timeout)

    def chain(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
    ) -> list[str]:
        """Return the frames from the source to the target; see `lookupTransform`."""
        call = target_frame, target_time, source_frame, source_time, fixed_frame
        return self._buffer._chain(*call)  # noqa: SLF001  # tf2's own name

    def lookupTwist(  # noqa: N802  # ROS 1's
        self, tracking_frame: str, observation_frame: str, time: Any, averaging_interval: Any
    ) -> Twist:
        """Return how fast a frame moves and turns, seen from another; see `lookupTwistFull`."""
        return self.lookupTwistFull(
            tracking_frame,
            observation_frame,
            observation_frame,
            (0.0, 0.0, 0.0),
            tracking_frame,
            time,
            averaging_interval,
        )

    def lookupTwistFull(  # noqa: N802, PLR0917  # ROS 1's
        self,
        tracking_frame: str,
        observation_frame: str,
        reference_frame: str,
        ref_point: Sequence[float],  # noqa: ARG002  # ROS 1 does not use it, either
        reference_point_frame: str,
        time: Any,
        averaging_interval: Any,
    ) -> Twist:
        """Return how fast a frame moves and turns, in the coordinates of another frame.

        Args:
            tracking_frame: Frame that moves.
            observation_frame: Frame that it is seen from.
            reference_frame: Frame of the result.
            ref_point: Not used.
            reference_point_frame: Frame whose origin moves so fast.
            time: Middle of the interval; 0 for the latest.
            averaging_interval: Duration to average over.

        Raises:
            Exception: As for `lookupTransform`.
        """
        latest = self.getLatestCommonTime(observation_frame, tracking_frame).to_nsec()
        middle = time.to_nsec() or latest
        width = averaging_interval.to_nsec()
        end = min(middle + width // 2, latest)
        start = max(_EARLIEST + width, end) - width
        seconds = (end - start) / 1e9
        stamps = [Time.from_nsec(moment) for moment in (start, end, middle)]
        before, turned_before = self.lookupTransform(observation_frame, tracking_frame, stamps[0])
        after, turned_after = self.lookupTransform(observation_frame, tracking_frame, stamps[1])
        turn = quaternion_matrix(quaternion_inverse(turned_before)) @ quaternion_matrix(
            turned_after
        )
        angle, axis, _ = rotation_from_matrix(turn)
        place, orientation = self.lookupTransform(reference_frame, tracking_frame, stamps[2])
        rotation = quaternion_matrix(orientation)[:3, :3]
        angular = rotation @ [part * angle / seconds for part in axis]
        linear = rotation @ [(b - a) / seconds for a, b in zip(before, after, strict=True)]
        linear += transformations.np.cross(place, angular)
        point = self.lookupTransform(reference_frame, reference_point_frame, stamps[2])
        moved = translation_matrix(point[0]) @ quaternion_matrix(point[1]) @ [*place, 1.0]
        linear += angular @ (moved[:3] - place)
        return tuple(linear.tolist()), tuple(angular.tolist())

    def frameExists(self, frame_id: str) -> bool:  # noqa: N802  # ROS 1's
        """Return whether there is a frame of a name that has a parent."""
        return _strip(frame_id) in self.getFrameStrings()

    def getFrameStrings(self) -> list[str]:  # noqa: N802  # ROS 1's
        """Return the names of all frames that have a parent, in the order of arrival."""
        return list(self._buffer.frames.histories())

    def allFramesAsString(self) -> str:  # noqa: N802  # ROS 1's
        """Return the parent of each frame, one per line."""
        return self._buffer.all_frames_as_string()

    def allFramesAsDot(self, current_time: Any = None) -> str:  # noqa: N802  # ROS 1's
        """Return the tree of frames in the language of Graphviz."""
        return self._buffer._allFramesAsDot(current_time)  # noqa: SLF001  # tf2's own name

    def getTFPrefix(self) -> str:  # noqa: N802  # ROS 1's
        """Return the prefix of frame names: none, as in tf2."""
        return ""

    def setUsingDedicatedThread(self, value: bool) -> None:  # noqa: N802  # ROS 1's
        """Set whether transforms arrive on a thread, so that it makes sense to wait for them."""
        self._using_dedicated_thread = value

    def clear(self) -> None:
        """Remove all transforms but the static ones."""
        self._buffer.clear()


class TransformerROS(Transformer):
    """Transform messages to other frames."""

    def asMatrix(self, target_frame: str, hdr: Any) -> Any:  # noqa: N802  # ROS 1's
        """Return the 4x4 matrix of the transform from the frame of a header to another frame."""
        parts = self.lookupTransform(target_frame, hdr.frame_id, hdr.stamp)
        return self.fromTranslationRotation(*parts)

    def fromTranslationRotation(self, translation: Any, rotation: Any) -> Any:  # noqa: N802
        """Return the 4x4 matrix of a translation and a rotation."""
        matrix = quaternion_matrix(rotation)
        matrix[:3, 3] = translation
        return matrix

    def _lookup(self, target: str, header: Any) -> TransformStamped:
        return self._buffer.lookup_transform(_strip(target), _strip(header.frame_id), header.stamp)

    def _transform(self, act: Callable[[Any, Any], Any], target_frame: str, message: Any) -> Any:
        moved = act(message, self._lookup(target_frame, message.header))
        return _restamped(moved, target_frame, message)

    def transformPoint(self, target_frame: str, ps: Any) -> Any:  # noqa: N802  # ROS 1's
        """Transform a PointStamped to another frame."""
        return self._transform(tf2_geometry_msgs.do_transform_point, target_frame, ps)

    def transformVector3(self, target_frame: str, v3s: Any) -> Any:  # noqa: N802  # ROS 1's
        """Rotate a Vector3Stamped to another frame."""
        return self._transform(tf2_geometry_msgs.do_transform_vector3, target_frame, v3s)

    def transformPose(self, target_frame: str, ps: Any) -> Any:  # noqa: N802  # ROS 1's
        """Transform a PoseStamped to another frame."""
        return self._transform(tf2_geometry_msgs.do_transform_pose, target_frame, ps)

    def transformQuaternion(self, target_frame: str, ps: Any) -> Any:  # noqa: N802  # ROS 1's
        """Transform a QuaternionStamped to another frame."""
        pose = PoseStamped(ps.header, Pose(orientation=ps.quaternion))
        moved = self.transformPose(target_frame, pose)
        return QuaternionStamped(moved.header, moved.pose.orientation)

    def transformPointCloud(self, target_frame: str, point_cloud: Any) -> Any:  # noqa: N802
        """Transform a PointCloud to another frame."""
        pose = pose_of(self._lookup(target_frame, point_cloud.header).transform)
        plain = (Plain((p.x, p.y, p.z), IDENTITY.rotation) for p in point_cloud.points)
        points = [Point32(*compose(pose, point).translation) for point in plain]
        moved = PointCloud(Header(), points, point_cloud.channels)
        return _restamped(moved, target_frame, point_cloud)


def _restamped(moved: Any, frame: str, message: Any) -> Any:
    """Give a transformed message the frame, and the time that it had."""
    moved.header = Header(stamp=message.header.stamp, frame_id=frame)
    return moved


class TransformListener(TransformerROS):
    """Receive transforms, and look them up.

    Args:
        options: Arguments of `Transformer`.
        named: Keyword arguments of `Transformer`.
    """

    def __init__(self, *options: Any, **named: Any) -> None:
        super().__init__(*options, **named)
        self._listener = tf2_ros.TransformListener(self._buffer)
        self.setUsingDedicatedThread(True)


class TransformBroadcaster:
    """Publish transforms of moving frames.

    Args:
        queue_size: Not used.
    """

    def __init__(self, queue_size: int = 100) -> None:  # noqa: ARG002  # ROS 1's
        self._broadcaster = tf2_ros.TransformBroadcaster()

    def sendTransform(  # noqa: N802  # ROS 1's
        self,
        translation: Sequence[float],
        rotation: Sequence[float],
        time: Any,
        child: str,
        parent: str,
    ) -> None:
        """Publish the pose of a frame in its parent.

        Args:
            translation: ``x, y, z`` in metres.
            rotation: ``x, y, z, w``.
            time: Time of the transform.
            child: Name of the frame.
            parent: Name of the parent.
        """
        transform = Transform(Vector3(*map(float, translation)), Quaternion(*map(float, rotation)))
        self.sendTransformMessage(
            TransformStamped(Header(stamp=time, frame_id=parent), child, transform)
        )

    def sendTransformMessage(self, transform: Any) -> None:  # noqa: N802  # ROS 1's
        """Publish one TransformStamped or several."""
        self._broadcaster.sendTransform(transform)
