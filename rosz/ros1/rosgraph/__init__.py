"""rosgraph: names, addresses, and the graph as the Master API has it (ROS wiki, rosgraph).

There is no master. `Master` answers from the live graph and the parameter store; what would
register something by hand is not there, and says so.
"""

from rosz.ros1.rosgraph import masterapi, names, network, rosenv
from rosz.ros1.rosgraph.arguments import myargv
from rosz.ros1.rosgraph.masterapi import (
    Master,
    MasterError,
    MasterException,
    MasterFailure,
    is_online,
)
from rosz.ros1.rosgraph.rosenv import (
    ROS_HOSTNAME,
    ROS_IP,
    ROS_IPV6,
    ROS_MASTER_URI,
    ROS_NAMESPACE,
    get_master_uri,
)

__all__ = (
    "ROS_HOSTNAME",
    "ROS_IP",
    "ROS_IPV6",
    "ROS_MASTER_URI",
    "ROS_NAMESPACE",
    "Master",
    "MasterError",
    "MasterException",
    "MasterFailure",
    "get_master_uri",
    "is_master_online",
    "masterapi",
    "myargv",
    "names",
    "network",
    "rosenv",
)

is_master_online = is_online
