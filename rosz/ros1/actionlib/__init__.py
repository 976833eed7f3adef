"""actionlib: goals that take time, of ROS 1 (ROS wiki, actionlib).

`rosz.actions` holds the logic; the modules here have ROS 1's names for it.
"""

from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.ros1.actionlib.action_client import (
    ActionClient,
    ClientGoalHandle,
    CommState,
    GoalManager,
    TerminalState,
    get_name_of_constant,
)
from rosz.ros1.actionlib.action_server import ActionServer
from rosz.ros1.actionlib.exceptions import ActionException
from rosz.ros1.actionlib.goal_id_generator import GoalIDGenerator
from rosz.ros1.actionlib.handle_tracker_deleter import HandleTrackerDeleter
from rosz.ros1.actionlib.server_goal_handle import ServerGoalHandle
from rosz.ros1.actionlib.simple_action_client import SimpleActionClient, SimpleGoalState
from rosz.ros1.actionlib.simple_action_server import SimpleActionServer
from rosz.ros1.actionlib.status_tracker import StatusTracker

__all__ = (
    "ActionClient",
    "ActionException",
    "ActionServer",
    "ClientGoalHandle",
    "CommState",
    "GoalIDGenerator",
    "GoalManager",
    "GoalStatus",
    "HandleTrackerDeleter",
    "ServerGoalHandle",
    "SimpleActionClient",
    "SimpleActionServer",
    "SimpleGoalState",
    "StatusTracker",
    "TerminalState",
    "get_name_of_constant",
)
