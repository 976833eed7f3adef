"""smach_ros: states for topics, services and actions, and introspection (ROS wiki, smach_ros).

Importing it makes smach write to rospy's log, and end with the node.
"""

from rosz.ros1 import rospy, smach
from rosz.ros1.smach_ros.action_server_wrapper import ActionServerWrapper
from rosz.ros1.smach_ros.condition_state import ConditionState
from rosz.ros1.smach_ros.introspection import IntrospectionClient, IntrospectionServer
from rosz.ros1.smach_ros.monitor_state import MonitorState
from rosz.ros1.smach_ros.ros_state import RosState
from rosz.ros1.smach_ros.service_state import ServiceState
from rosz.ros1.smach_ros.simple_action_state import SimpleActionState
from rosz.ros1.smach_ros.util import set_preempt_handler

__all__ = (
    "ActionServerWrapper",
    "ConditionState",
    "IntrospectionClient",
    "IntrospectionServer",
    "MonitorState",
    "RosState",
    "ServiceState",
    "SimpleActionState",
    "set_preempt_handler",
)

smach.set_loggers(rospy.loginfo, rospy.logwarn, rospy.logdebug, rospy.logerr)
smach.set_shutdown_check(rospy.is_shutdown)
