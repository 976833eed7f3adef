"""tf2_ros.buffer_interface: the methods of buffers, and the types that they transform."""

# ruff: noqa: ARG002  # of methods that subclasses override

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import Any

from rosz.msgs.geometry_msgs.msg import PointStamped, PoseStamped, TransformStamped, Vector3Stamped
from rosz.msgs.std_msgs.msg import Header
from rosz.ros1.client.tf2_geometry_msgs import TRANSFORMATIONS, from_msg_msg, to_msg_msg

__all__ = (
    "BufferInterface",
    "ConvertRegistration",
    "NotImplementedException",
    "Stamped",
    "TransformRegistration",
    "TypeException",
    "convert",
)


class TypeException(Exception):
    """Messages of the type cannot be transformed or converted."""

    def __init__(self, errstr: str) -> None:
        super().__init__(errstr)
        self.errstr: str = errstr


class NotImplementedException(Exception):
    """A class does not look up transforms."""

    def __init__(self) -> None:
        self.errstr: str = "CanTransform or LookupTransform not implemented"
        super().__init__(self.errstr)


def Stamped(obj: Any, stamp: Any, frame_id: str) -> Any:  # noqa: N802  # ROS 1's
    """Give an object a header, and return it."""
    obj.header = Header(stamp=stamp, frame_id=frame_id)
    return obj


Function = Callable[..., Any]


class _Table(dict[Any, Function]):
    """Functions by type; all objects of a class share one table."""

    def __init__(self, doing: str) -> None:
        super().__init__()
        self._doing = doing

    def __missing__(self, key: Any) -> Function:
        registered = ", ".join(map(_name, self)) or "none"
        raise TypeException(f"cannot {self._doing} {_name(key)}; known: {registered}")


def _name(key: Any) -> str:
    return " to ".join(map(_name, key)) if isinstance(key, tuple) else str(key.__name__)


_transforms, _converts = _Table("transform"), _Table("convert")
_to_msg, _from_msg = _Table("make a message of"), _Table("make of a message")


class TransformRegistration:
    """The functions that transform messages, by the class of the message."""

    def add(self, key: type[Any], callback: Function) -> None:
        """Add a function of a message and a TransformStamped."""
        _transforms[key] = callback

    def get(self, key: type[Any]) -> Function:
        """Return the function of a class.

        Raises:
            TypeException: There is none.
        """
        return _transforms[key]


class ConvertRegistration:
    """The functions that convert between types and messages."""

    def add_from_msg(self, key: type[Any], callback: Function) -> None:
        """Add a function that makes an object of a class of a message."""
        _from_msg[key] = callback

    def add_to_msg(self, key: type[Any], callback: Function) -> None:
        """Add a function that makes a message of an object of a class."""
        _to_msg[key] = callback

    def add_convert(self, key: tuple[type[Any], type[Any]], callback: Function) -> None:
        """Add a function that makes an object of the second class of one of the first."""
        _converts[key] = callback

    def get_from_msg(self, key: type[Any]) -> Function:
        """Return the function for a class, or raise a TypeException; see `add_from_msg`."""
        return _from_msg[key]

    def get_to_msg(self, key: type[Any]) -> Function:
        """Return the function for a class, or raise a TypeException; see `add_to_msg`."""
        return _to_msg[key]

    def get_convert(self, key: tuple[type[Any], type[Any]]) -> Function:
        """Return the function for two classes, or raise a TypeException; see `add_convert`."""
        return _converts[key]


def convert(a: Any, b_type: type[Any]) -> Any:
    """Return an object as one of another class.

    Raises:
        TypeException: No function was registered for it.
    """
    try:
        direct = _converts[type(a), b_type]
    except TypeException:
        if type(a) is b_type:
            return deepcopy(a)
        to_msg, from_msg = _to_msg[type(a)], _from_msg[b_type]
        return from_msg(to_msg(a))
    return direct(a)


_transforms.update(TRANSFORMATIONS)
for _message in PointStamped, PoseStamped, Vector3Stamped:
    _to_msg[_message] = to_msg_msg
    _from_msg[_message] = from_msg_msg


class BufferInterface:
    """Base class of objects that look up transforms.

    Attributes:
        registration: The functions that transform messages.
    """

    registration = TransformRegistration()

    def transform(
        self, object_stamped: Any, target_frame: str, timeout: Any = None, new_type: Any = None
    ) -> Any:
        """Transform a stamped point, pose, vector or wrench to another frame.

        Args:
            object_stamped: Message to transform.
            target_frame: Frame to transform the message to.
            timeout: Longest time to wait for the transform.
            new_type: Class to convert the result to.

        Raises:
            TypeException: Messages of the type cannot be transformed or converted.
            TransformException: The transform is not known.
        """
        act = self.registration.get(type(object_stamped))
        header = object_stamped.header
        stamped = self.lookup_transform(target_frame, header.frame_id, header.stamp, timeout)
        moved = act(object_stamped, stamped)
        return convert(moved, new_type) if new_type else moved

    def transform_full(
        self,
        object_stamped: Any,
        target_frame: str,
        target_time: Any,
        fixed_frame: str,
        timeout: Any = None,
        new_type: Any = None,
    ) -> Any:
        """Transform a message to another frame at another time; see `transform`.

        ``target_time`` is the time of that frame; ``fixed_frame`` does not move meanwhile.
        """
        act = self.registration.get(type(object_stamped))
        header = object_stamped.header
        stamped = self.lookup_transform_full(
            target_frame, target_time, header.frame_id, header.stamp, fixed_frame, timeout
        )
        moved = act(object_stamped, stamped)
        return convert(moved, new_type) if new_type else moved

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = None
    ) -> TransformStamped:
        """Return the transform from the source frame to the target frame.

        Frames, time and errors are those of `BufferCore.lookup_transform_core`. The timeout
        limits the wait for the transform; without a timeout the method does not wait.
        """
        raise NotImplementedException

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = None,
    ) -> TransformStamped:
        """Return the transform from a frame at one time to a frame at another time.

        Frames, times and errors are those of `BufferCore.lookup_transform_full_core`, the timeout
        is that of `lookup_transform`.
        """
        raise NotImplementedException

    def can_transform(
        self, target_frame: str, source_frame: str, time: Any, timeout: Any = None
    ) -> Any:
        """Return whether a transform is known; see `lookup_transform`."""
        raise NotImplementedException

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = None,
    ) -> Any:
        """Return whether a transform between two times is known; see `lookup_transform_full`."""
        raise NotImplementedException
