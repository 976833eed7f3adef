"""tf.listener: asking where frames are."""

from __future__ import annotations

from typing import Any

from rosz.errors import ExtrapolationNeeded as ExtrapolationException
from rosz.errors import FrameNotFound as LookupException
from rosz.errors import FramesNotConnected as ConnectivityException
from rosz.errors import TransformError as Exception  # noqa: A004  # ROS 1's
from rosz.msgs.geometry_msgs.msg import Pose, PoseStamped, QuaternionStamped, TransformStamped
from rosz.ros1 import tf2_geometry_msgs, tf2_ros

__all__ = (
    "ConnectivityException",
    "Exception",
    "ExtrapolationException",
    "LookupException",
    "TransformListener",
    "Transformer",
    "TransformerROS",
)

Parts = tuple[list[float], list[float]]
"""Translation ``x, y, z`` and rotation ``x, y, z, w``."""


def _bare(frame: str) -> str:
    return frame.removeprefix("/")


def _parts(found: TransformStamped) -> Parts:
    t, r = found.transform.translation, found.transform.rotation
    return [t.x, t.y, t.z], [r.x, r.y, r.z, r.w]


class Transformer:
    """Transforms of the last seconds; a slash in front of the name of a frame does not count.

    Args:
        interpolate: Not used: it always does.
        cache_time: How long transforms are kept; ten seconds when not given.
    """

    def __init__(self, interpolate: bool = True, cache_time: Any = None) -> None:  # noqa: ARG002
        self._buffer = tf2_ros.Buffer(cache_time)

    def setTransform(self, transform: Any, authority: str = "default_authority") -> None:  # noqa: N802
        """Take note of a TransformStamped."""
        self._buffer.set_transform(transform, authority)

    def canTransform(self, target_frame: str, source_frame: str, time: Any) -> bool:  # noqa: N802
        """Tell whether a transform is known."""
        return bool(self._buffer.can_transform(_bare(target_frame), _bare(source_frame), time))

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
            target_frame: The frame that coordinates are wanted in.
            source_frame: The frame that they are in.
            time: When; 0 for the latest.
            timeout: How long to wait.
            polling_sleep_duration: Not used.

        Raises:
            Exception: It is not known in time; the text says why.
        """
        known, reason = self._buffer.can_transform(
            _bare(target_frame), _bare(source_frame), time, timeout, return_debug_tuple=True
        )
        if not known:
            raise Exception(reason)  # tf's own

    def lookupTransform(self, target_frame: str, source_frame: str, time: Any) -> Parts:  # noqa: N802
        """Return what brings coordinates of the source frame into the target frame.

        Raises:
            LookupException: There is no such frame.
            ConnectivityException: They belong to separate trees.
            ExtrapolationException: The time is before or after what is known.
        """
        return _parts(self._buffer.lookup_transform(_bare(target_frame), _bare(source_frame), time))

    def lookupTransformFull(  # noqa: N802  # ROS 1's
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
    ) -> Parts:
        """Return what brings coordinates of one time into a frame at another time.

        Raises:
            Exception: It is not known; the class says why.
        """
        return _parts(
            self._buffer.lookup_transform_full(
                _bare(target_frame),
                target_time,
                _bare(source_frame),
                source_time,
                _bare(fixed_frame),
            )
        )

    def getLatestCommonTime(self, source_frame: str, dest_frame: str) -> Any:  # noqa: N802  # ROS 1's
        """Return the latest time at which a transform is known."""
        return self._buffer.get_latest_common_time(_bare(source_frame), _bare(dest_frame))

    def frameExists(self, frame_id: str) -> bool:  # noqa: N802  # ROS 1's
        """Tell whether there is a frame of that name."""
        return self._buffer.frames.has(_bare(frame_id))

    def getFrameStrings(self) -> list[str]:  # noqa: N802  # ROS 1's
        """Return the names of all frames."""
        return self._buffer.frames.frames()

    def allFramesAsString(self) -> str:  # noqa: N802  # ROS 1's
        """Return who is whose parent, a line each."""
        return self._buffer.all_frames_as_string()

    def clear(self) -> None:
        """Forget what is not static."""
        self._buffer.clear()


class TransformerROS(Transformer):
    """Brings messages into other frames."""

    def asMatrix(self, target_frame: str, hdr: Any) -> Any:  # noqa: N802  # ROS 1's
        """Return the 4x4 matrix that brings what has a header into a frame."""
        found = self.lookupTransform(target_frame, hdr.frame_id, hdr.stamp)
        return self.fromTranslationRotation(*found)

    def fromTranslationRotation(self, translation: Any, rotation: Any) -> Any:  # noqa: N802
        """Return the 4x4 matrix of a translation and a rotation."""
        from rosz.ros1.tf.transformations import quaternion_matrix

        matrix = quaternion_matrix(rotation)
        matrix[:3, 3] = translation
        return matrix

    def _found(self, target: str, header: Any) -> TransformStamped:
        return self._buffer.lookup_transform(_bare(target), _bare(header.frame_id), header.stamp)

    def transformPoint(self, target_frame: str, ps: Any) -> Any:  # noqa: N802  # ROS 1's
        """Return a PointStamped in another frame."""
        found = self._found(target_frame, ps.header)
        return tf2_geometry_msgs.do_transform_point(ps, found)

    def transformVector3(self, target_frame: str, v3s: Any) -> Any:  # noqa: N802  # ROS 1's
        """Return a Vector3Stamped, which only turns, in another frame."""
        found = self._found(target_frame, v3s.header)
        return tf2_geometry_msgs.do_transform_vector3(v3s, found)

    def transformPose(self, target_frame: str, ps: Any) -> Any:  # noqa: N802  # ROS 1's
        """Return a PoseStamped in another frame."""
        found = self._found(target_frame, ps.header)
        return tf2_geometry_msgs.do_transform_pose(ps, found)

    def transformQuaternion(self, target_frame: str, ps: Any) -> Any:  # noqa: N802  # ROS 1's
        """Return a QuaternionStamped in another frame."""
        pose = PoseStamped(ps.header, Pose(orientation=ps.quaternion))
        moved = self.transformPose(target_frame, pose)
        return QuaternionStamped(moved.header, moved.pose.orientation)


class TransformListener(TransformerROS):
    """Hears of transforms.

    Args:
        options: What `Transformer` takes.
    """

    def __init__(self, *options: Any, **named: Any) -> None:
        super().__init__(*options, **named)
        self._listener = tf2_ros.TransformListener(self._buffer)
