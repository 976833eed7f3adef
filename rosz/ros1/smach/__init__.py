"""smach: hierarchical state machines in Python (ROS wiki, smach).

Nothing here needs a node; `smach_ros` has the states that use topics, services and actions.
"""

from rosz.ros1.smach.concurrence import Concurrence
from rosz.ros1.smach.container import Container
from rosz.ros1.smach.exceptions import (
    InvalidConstructionError,
    InvalidStateError,
    InvalidTransitionError,
    InvalidUserCodeError,
    SmachError,
)
from rosz.ros1.smach.iterator import Iterator
from rosz.ros1.smach.log import logdebug, logerr, loginfo, logwarn, set_loggers
from rosz.ros1.smach.sequence import Sequence
from rosz.ros1.smach.state import CBState, State
from rosz.ros1.smach.state_machine import StateMachine
from rosz.ros1.smach.user_data import Remapper, UserData
from rosz.ros1.smach.util import (
    CBInterface,
    cb_interface,
    has_smach_interface,
    is_shutdown,
    set_shutdown_check,
)

__all__ = (
    "CBInterface",
    "CBState",
    "Concurrence",
    "Container",
    "InvalidConstructionError",
    "InvalidStateError",
    "InvalidTransitionError",
    "InvalidUserCodeError",
    "Iterator",
    "Remapper",
    "Sequence",
    "SmachError",
    "State",
    "StateMachine",
    "UserData",
    "cb_interface",
    "has_smach_interface",
    "is_shutdown",
    "logdebug",
    "logerr",
    "loginfo",
    "logwarn",
    "set_loggers",
    "set_shutdown_check",
)
