"""rosgraph: names, addresses, and the Master API (ROS wiki, rosgraph).

There is no master. `Master` reads the live graph and the parameter store; it lacks the calls that
register something, since nodes declare themselves.

Programs also import its modules, as in ROS 1.
"""

from types import ModuleType

from rosz.ros1.tools.rosgraph import masterapi, names, network
from rosz.ros1.tools.rosgraph.masterapi import (
    Master,
    MasterError,
    MasterException,
    MasterFailure,
    is_online,
)
from rosz.ros1.tools.rosgraph.names import (
    ROS_HOSTNAME,
    ROS_IP,
    ROS_IPV6,
    ROS_MASTER_URI,
    ROS_NAMESPACE,
    get_master_uri,
    myargv,
)

rosenv: ModuleType  # built by the importer

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
