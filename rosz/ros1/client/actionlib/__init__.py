"""actionlib: goals that take time, of ROS 1 (ROS wiki, actionlib).

`rosz.actions` holds the logic; the modules here have ROS 1's names for it. ROS 1's package has no
``__all__``, and programs use whatever ``from actionlib import *`` binds: ``threading``, ``rospy``.
"""

import threading
import time
import traceback
import weakref

from rosz.errors import UsageError as ActionException
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosz.msgs.std_msgs.msg import Header
from rosz.ros1.client import rospy
from rosz.ros1.client.actionlib import action_client, action_server
from rosz.ros1.client.actionlib import action_client as simple_action_client
from rosz.ros1.client.actionlib import action_server as exceptions
from rosz.ros1.client.actionlib import action_server as goal_id_generator
from rosz.ros1.client.actionlib import action_server as handle_tracker_deleter
from rosz.ros1.client.actionlib import action_server as server_goal_handle
from rosz.ros1.client.actionlib import action_server as simple_action_server
from rosz.ros1.client.actionlib import action_server as status_tracker
from rosz.ros1.client.actionlib.action_client import (
    ActionClient,
    ClientGoalHandle,
    CommState,
    GoalManager,
    SimpleActionClient,
    SimpleGoalState,
    TerminalState,
    get_name_of_constant,
)
from rosz.ros1.client.actionlib.action_server import (
    ActionServer,
    GoalIDGenerator,
    HandleTrackerDeleter,
    ServerGoalHandle,
    SimpleActionServer,
    StatusTracker,
)

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
