"""smach_ros.util: containers end with the node."""

from __future__ import annotations

from rosz.ros1 import rospy
from rosz.ros1.rospy import core
from rosz.ros1.smach import Container

__all__ = ("set_preempt_handler",)

_CHECK_PERIOD = 0.1
_LOG_PERIOD = 1.0


def set_preempt_handler(sc: Container) -> None:
    """Preempt a container when the node is shut down, and wait until it has ended.

    Args:
        sc: The outermost container; it preempts those within.
    """

    def preempt() -> None:
        sc.request_preempt()
        while sc.is_running():
            rospy.loginfo_throttle(_LOG_PERIOD, "shutting down: waiting for the state machine")
            rospy.sleep(_CHECK_PERIOD)

    core.add_client_shutdown_hook(preempt)
