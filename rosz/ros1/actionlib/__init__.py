"""actionlib: goals that take time, of ROS 1 (ROS wiki, actionlib).

`rosz.actions` holds the logic; the modules here have ROS 1's names for it. ROS 1's package has no
``__all__``, and programs use whatever ``from actionlib import *`` binds: ``threading``, ``rospy``.
"""

import threading
import time
import traceback
import weakref

from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosz.msgs.std_msgs.msg import Header
from rosz.ros1 import rospy
from rosz.ros1.actionlib import (
    action_client,
    action_server,
    exceptions,
    goal_id_generator,
    handle_tracker_deleter,
    server_goal_handle,
    simple_action_client,
    simple_action_server,
    status_tracker,
)
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
    "GoalID",
    "GoalIDGenerator",
    "GoalManager",
    "GoalStatus",
    "GoalStatusArray",
    "HandleTrackerDeleter",
    "Header",
    "ServerGoalHandle",
    "SimpleActionClient",
    "SimpleActionServer",
    "SimpleGoalState",
    "StatusTracker",
    "TerminalState",
    "action_client",
    "action_server",
    "exceptions",
    "get_name_of_constant",
    "goal_id_generator",
    "handle_tracker_deleter",
    "rospy",
    "server_goal_handle",
    "simple_action_client",
    "simple_action_server",
    "status_tracker",
    "threading",
    "time",
    "traceback",
    "weakref",
)
