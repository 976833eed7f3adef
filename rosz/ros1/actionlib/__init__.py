"""actionlib: goals that take their time, over topics as in ROS 1 (ROS wiki, actionlib).

There are the simple client and the simple server, one goal at a time each. ``ActionClient``,
``ActionServer`` and their goal handles are not there.
"""

from rosz.ros1.actionlib.client import SimpleActionClient, SimpleGoalState
from rosz.ros1.actionlib.server import SimpleActionServer

__all__ = ("SimpleActionClient", "SimpleActionServer", "SimpleGoalState")
