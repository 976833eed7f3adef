"""actionlib.status_tracker: the state of a goal, as ROS 1's action servers kept it."""

from __future__ import annotations

from typing import Any

from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.ros1 import rospy
from rosz.ros1.actionlib.goal_id_generator import GoalIDGenerator

__all__ = ("StatusTracker",)


class StatusTracker:
    """The state of a goal.

    Args:
        goal_id: Identification of the goal, together with ``status``.
        status: Its state.
        goal: Message that carried it, instead of both.

    Attributes:
        goal: As given.
        status: State of the goal.
        handle_tracker: Whatever a program keeps here.
        handle_destruction_time: When the goal ended; 0 while it has not.
        id_generator: Makes identifications.
    """

    def __init__(self, goal_id: Any = None, status: Any = None, goal: Any = None) -> None:
        self.goal: Any = None
        self.handle_tracker: Any = None
        self.status: Any = GoalStatus()
        self.handle_destruction_time: Any = rospy.Time()
        self.id_generator = GoalIDGenerator()
        if goal_id:
            self.status.goal_id, self.status.status = goal_id, status
            return
        self.goal = goal
        self.status.goal_id = goal.goal_id
        if not goal.goal_id.id:
            self.status.goal_id = self.id_generator.generate_ID()
        if self.status.goal_id.stamp == rospy.Time():
            self.status.goal_id.stamp = rospy.Time.now()
