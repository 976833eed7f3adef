"""rospy: ROS 1's Python client library over `rosz.node` (ROS wiki, rospy).

One process is one node. Programs also import its modules, as in ROS 1.
"""

from __future__ import annotations

import sys
from typing import Any

from rosz.ros1 import exceptions
from rosz.ros1.client.rospy import client, service, timer
from rosz.ros1.client.rospy.client import *  # noqa: F403
from rosz.ros1.client.rospy.core import (
    get_node_uri,
    get_ros_root,
    is_shutdown,
    logdebug_once,
    logdebug_throttle,
    logdebug_throttle_identical,
    logerr_once,
    logerr_throttle,
    logerr_throttle_identical,
    logfatal,
    logfatal_once,
    logfatal_throttle,
    logfatal_throttle_identical,
    loginfo_once,
    loginfo_throttle,
    loginfo_throttle_identical,
    logout,
    logwarn_once,
    logwarn_throttle,
    logwarn_throttle_identical,
    parse_rosrpc_uri,
    signal_shutdown,
)
from rosz.ros1.client.rospy.msg import AnyMsg
from rosz.ros1.client.rospy.names import (
    get_caller_id,
    get_name,
    get_namespace,
    remap_name,
    resolve_name,
)
from rosz.ros1.client.rospy.rostime import Duration, Time, get_rostime, get_time
from rosz.ros1.client.rospy.service import *  # noqa: F403
from rosz.ros1.client.rospy.timer import *  # noqa: F403
from rosz.ros1.client.rospy.topics import Publisher, SubscribeListener, Subscriber
from rosz.ros1.exceptions import *  # noqa: F403
from rosz.ros1.modules import attribute

Header: Any  # loaded when it is first used, as the next two
MasterProxy: Any
Message: Any

__all__: tuple[str, ...] = (
    "AnyMsg",
    "Duration",
    "Header",
    "MasterProxy",
    "Message",
    "Publisher",
    "SubscribeListener",
    "Subscriber",
    "Time",
    "get_caller_id",
    "get_name",
    "get_namespace",
    "get_node_uri",
    "get_ros_root",
    "get_rostime",
    "get_time",
    "is_shutdown",
    "logdebug_once",
    "logdebug_throttle",
    "logdebug_throttle_identical",
    "logerr_once",
    "logerr_throttle",
    "logerr_throttle_identical",
    "logfatal",
    "logfatal_once",
    "logfatal_throttle",
    "logfatal_throttle_identical",
    "loginfo_once",
    "loginfo_throttle",
    "loginfo_throttle_identical",
    "logout",
    "logwarn_once",
    "logwarn_throttle",
    "logwarn_throttle_identical",
    "parse_rosrpc_uri",
    "remap_name",
    "resolve_name",
    "signal_shutdown",
)
__all__ += client.__all__ + exceptions.__all__ + service.__all__ + timer.__all__

__getattr__ = attribute(
    "rospy",
    sys.modules[__name__],
    {
        "Header": "rosz.msgs.std_msgs.msg",
        "MasterProxy": "rosz.ros1.client.rospy.msproxy",
        "Message": "rosz.message",
        "msproxy": "rosz.ros1.client.rospy.msproxy",
        "numpy_msg": "rosz.ros1.client.rospy.numpy_msg",
    },
)
