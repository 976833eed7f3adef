"""smach_ros.ros_state: a state that knows its node, as in smach of ROS 2."""

from __future__ import annotations

from typing import Any

from rosz.ros1.smach import State

__all__ = ("RosState",)


class RosState(State):
    """Base class of states that use a node.

    Args:
        node: The node.
        kwargs: Arguments of ``smach.State``.
    """

    def __init__(self, node: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._node = node

    @property
    def node(self) -> Any:
        """The node."""
        return self._node
