"""actionlib.goal_id_generator: identifications of goals."""

from __future__ import annotations

import itertools

from rosz.msgs.actionlib_msgs.msg import GoalID
from rosz.ros1 import rospy

__all__ = ("GoalIDGenerator",)

_numbers = itertools.count(1)


class GoalIDGenerator:
    """Makes identifications of goals, which are unique.

    Args:
        name: Name to begin them with; that of the node when not given.
    """

    def __init__(self, name: str | None = None) -> None:
        self.name: str = rospy.get_name() if name is None else name

    def set_name(self, name: str) -> None:
        """Set the name to begin identifications with."""
        self.name = name

    def generate_ID(self) -> GoalID:  # noqa: N802  # ROS 1's
        """Return a new identification with the current time."""
        now = rospy.Time.now()
        return GoalID(now, f"{self.name}-{next(_numbers)}-{now.secs}.{now.nsecs}")
