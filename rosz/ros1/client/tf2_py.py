"""tf2_py: the buffer of transforms and its errors (ROS wiki, tf2_py)."""

from __future__ import annotations

from typing import Any

from rosz.errors import ExtrapolationNeeded as ExtrapolationException
from rosz.errors import FrameNotFound as LookupException
from rosz.errors import FramesNotConnected as ConnectivityException
from rosz.errors import TransformArgument as InvalidArgumentException
from rosz.errors import TransformError as TransformException
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rosz.msgs.std_msgs.msg import Header
from rosz.transforms import Buffer as Frames
from rosz.transforms import Pose, pose_of

__all__ = (
    "BufferCore",
    "ConnectivityException",
    "ExtrapolationException",
    "InvalidArgumentException",
    "LookupException",
    "TimeoutException",
    "TransformException",
)

_TEN_SECONDS = 10 * 10**9


class TimeoutException(TransformException):
    """A transform did not become known in time."""


def nanoseconds(value: Any) -> int:
    """Return a time or duration of rospy or rclpy, or seconds, as nanoseconds."""
    if hasattr(value, "nanoseconds"):
        return int(value.nanoseconds)
    return value.to_nsec() if hasattr(value, "to_nsec") else round(float(value or 0) * 1e9)


class BufferCore:
    """A buffer of the transforms of the last seconds, which never waits.

    Args:
        cache_time: Duration, or seconds, for which transforms are kept; 10 s when not given.

    Attributes:
        frames: The buffer that does the work.
    """

    def __init__(self, cache_time: Any = None) -> None:
        self.frames: Frames = Frames(
            _TEN_SECONDS if cache_time is None else nanoseconds(cache_time)
        )

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
            nanoseconds(transform.header.stamp),
            pose_of(transform.transform),
            static=static,
            authority=authority,
        )

    def clear(self) -> None:
        """Remove all transforms but the static ones."""
        self.frames.clear()

    def lookup_transform_core(
        self, target_frame: str, source_frame: str, time: Any
    ) -> TransformStamped:
        """Return the transform from the source to the target frame.

        Args:
            target_frame: Frame to transform coordinates to.
            source_frame: Frame of the coordinates.
            time: Time of the transform; 0 for the latest.

        Raises:
            TransformException: The transform is not known; the subclass tells the reason.
        """
        pose, stamp = self.frames.lookup(target_frame, source_frame, nanoseconds(time))
        return _stamped(target_frame, source_frame, pose, stamp)

    def lookup_transform_full_core(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
    ) -> TransformStamped:
        """Return the transform from a frame at one time to a frame at another time.

        The fixed frame does not move meanwhile; see `lookup_transform_core`.
        """
        pose, stamp = self.frames.lookup_full(
            target_frame,
            nanoseconds(target_time),
            source_frame,
            nanoseconds(source_time),
            fixed_frame,
        )
        return _stamped(target_frame, source_frame, pose, stamp)

    def can_transform_core(
        self, target_frame: str, source_frame: str, time: Any
    ) -> tuple[bool, str]:
        """Return whether a transform is known, and why not."""
        reason = self.frames.why_not(target_frame, source_frame, nanoseconds(time))
        return not reason, reason

    def can_transform_full_core(self, *call: Any) -> tuple[bool, str]:
        """Return whether a transform between two times is known, and why not.

        Args:
            call: Arguments of `lookup_transform_full_core`.
        """
        try:
            self.lookup_transform_full_core(*call)
        except TransformException as error:
            return False, str(error) or "unknown"
        return True, ""

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Any:
        """Return the latest time at which a transform is known."""
        return Time.from_nsec(self.frames.latest_common(target_frame, source_frame))

    def all_frames_as_string(self) -> str:
        """Return the parent of each frame, one per line."""
        return "".join(
            f"Frame {name} exists with parent {history.newest.parent}.\n"
            for name, history in self.frames.histories().items()
        )

    def all_frames_as_yaml(self) -> str:
        """Return the state of each frame as YAML."""
        lines = [
            f"{name}: \n  parent: '{history.newest.parent}'\n  broadcaster: '{history.authority}'\n"
            f"  rate: {history.rate:.3f}\n  most_recent_transform: {history.latest / 1e9:.3f}\n"
            f"  oldest_transform: {history.oldest / 1e9:.3f}\n"
            f"  buffer_length: {(history.latest - history.oldest) / 1e9:.3f}\n"
            for name, history in self.frames.histories().items()
        ]
        return "".join(lines) or "{}"

    def _allFramesAsDot(self, current_time: Any = None) -> str:  # noqa: ARG002, N802  # ROS 1's
        """Return the tree of frames in the language of Graphviz."""
        lines = [
            f'"{history.newest.parent}" -> "{name}"[label="Broadcaster: {history.authority}\\n'
            f"Average rate: {history.rate:.3f} Hz\\n"
            f"Most recent transform: {history.latest / 1e9:.3f} \\n"
            f'Buffer length: {(history.latest - history.oldest) / 1e9:.3f} sec\\n"];\n'
            for name, history in self.frames.histories().items()
        ]
        return "digraph G {\n" + "".join(lines) + "}"

    def _chain(
        self, target_frame: str, target_time: Any, source_frame: str, *call: Any
    ) -> list[str]:
        """Return the frames between two frames; see `lookup_transform_full_core`."""
        self.lookup_transform_full_core(target_frame, target_time, source_frame, *call)
        return self.frames.chain(target_frame, source_frame)

    def _frameExists(self, frame: str) -> bool:  # noqa: N802  # ROS 1's
        """Return whether there is a frame of a name."""
        return self.frames.has(frame)

    def _getFrameStrings(self) -> list[str]:  # noqa: N802  # ROS 1's
        """Return the names of all frames."""
        return self.frames.frames()


def _stamped(target: str, source: str, pose: Pose, stamp: int) -> TransformStamped:
    header = Header(stamp=Time.from_nsec(stamp), frame_id=target)
    transform = Transform(Vector3(*pose.translation), Quaternion(*pose.rotation))
    return TransformStamped(header, source, transform)
