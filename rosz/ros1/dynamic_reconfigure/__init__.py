"""dynamic_reconfigure: ROS 1's names for `rosz.reconfigure`.

``.cfg`` files run unchanged, and the modules that catkin generates from them can be imported
without a build: ``from my_pkg.cfg import TutorialsConfig`` (ROS wiki, dynamic_reconfigure). May
import what rospy is built on, and rospy's own modules.

`PUBLIC_MODULES` are those that the importer of ``.cfg`` files needs alone.
"""

from rosz.ros1.dynamic_reconfigure.exceptions import (
    DynamicReconfigureCallbackException,
    DynamicReconfigureException,
    DynamicReconfigureParameterException,
)
from rosz.ros1.dynamic_reconfigure.search import find_reconfigure_services, get_parameter_names

PUBLIC_MODULES = ("cfgfile", "search")

__all__ = (
    "DynamicReconfigureCallbackException",
    "DynamicReconfigureException",
    "DynamicReconfigureParameterException",
    "find_reconfigure_services",
    "get_parameter_names",
)
