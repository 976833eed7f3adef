"""Defaults that ROS 2's definitions have, and ROS 1's have not."""

from __future__ import annotations

from typing import Any, ClassVar

__all__ = ("Ros2Default",)


class Ros2Default:
    """Makes the default of a field that ROS 1 has with zero, such as ``Quaternion.w``.

    Args:
        value: Default in ROS 2.

    Attributes:
        ros1: Whether ROS 1's defaults hold in this process; constructors take nothing that could
            tell. What makes ROS 1's names importable sets it.
    """

    ros1: ClassVar[bool] = False

    def __init__(self, value: float) -> None:
        self._value = value
        self._zero = type(value)(0)

    def __repr__(self) -> str:
        return f"Ros2Default({self._value})"

    def __call__(self) -> Any:
        """Return the default."""
        return self._zero if Ros2Default.ros1 else self._value
