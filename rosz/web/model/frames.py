"""The frames of the system, while a page shows them in space."""

from __future__ import annotations

import struct

from rosz.access import PagePolicy
from rosz.errors import DecodeError, TransformError
from rosz.node import Node
from rosz.transforms import IDENTITY, Buffer, Pose, TransformListener

_PREFERRED = ("map", "odom", "world", "base_footprint", "base_link")
_LENGTH = 10_000_000_000
_HEADER_SIZE = 16


class Frames:
    """All frames and their transforms, received until it is closed.

    Args:
        node: The node that receives them.
        permission: The rights of the page; without it, all.

    Attributes:
        buffer: The transforms.
        fault: Reason why the page may not receive them; empty if it may.
        version: Number that grows with each message.
    """

    def __init__(self, node: Node, permission: PagePolicy | None = None) -> None:
        self.buffer: Buffer = Buffer(_LENGTH)
        self.fault: str = "" if permission is None else permission.objection("subscribe", "/tf")
        self.version: int = 0
        self._node = node
        self._listener = None if self.fault else TransformListener(self.buffer, node, self._count)

    def _count(self, _transforms: list[object], _publisher: bytes, *, static: bool) -> None:
        del static
        self.version += 1

    def best(self) -> str:
        """Return the frame that most views are fixed to; empty if there is none."""
        names = self.buffer.frames()
        for name in _PREFERRED:
            if name in names:
                return name
        children = self.buffer.histories()
        roots = [name for name in names if name not in children]
        return next(iter(roots or names), "")

    def find(self, fixed: str, frame: str, stamp: int = 0) -> Pose:
        """Return the pose of a frame in another one.

        Args:
            fixed: Frame to transform to.
            frame: Frame of the coordinates; a leading slash is ignored.
            stamp: Time in nanoseconds; 0 for the latest one.

        Raises:
            TransformError: It is not known.
        """
        frame = frame.removeprefix("/")
        if frame and frame == fixed:
            return IDENTITY
        return self.buffer.lookup(fixed, frame, stamp)[0]

    def locate(self, fixed: str, frame: str, stamp: int = 0) -> tuple[Pose | None, str]:
        """Return the pose of a frame as `find` does, or None and the reason why it is not known."""
        if not frame:
            return None, "the message has no frame_id"
        if not fixed:
            return None, "no fixed frame is chosen"
        try:
            return self.find(fixed, frame, stamp), ""
        except TransformError as error:
            return None, str(error).strip()

    def age(self, frame: str) -> float | None:
        """Return the seconds since the newest transform of a frame; None for a static one."""
        history = self.buffer.histories().get(frame)
        if history is None or history.static:
            return None
        return max((self._node.now() - history.latest) / 1e9, 0.0)

    def close(self) -> None:
        """Stop receiving."""
        if self._listener is not None:
            self._listener.close()


def read_frame(payload: bytes, type_name: str) -> str:
    """Return the frame of an encoded message that begins with a header.

    Raises:
        DecodeError: The payload is too short, or not CDR.
    """
    order = "<" if payload[1:2] == b"\x01" else ">"
    if len(payload) < _HEADER_SIZE:
        raise DecodeError(type_name, 0, f"expected a header, got {payload.hex(' ')}")
    (length,) = struct.unpack_from(f"{order}I", payload, _HEADER_SIZE - 4)
    text = payload[_HEADER_SIZE : _HEADER_SIZE + length]
    return text.rstrip(b"\0").decode("utf-8", "replace").removeprefix("/")
