"""``rospy.impl.rosout``: nothing but the table of levels that programs set loggers by."""

from __future__ import annotations

from rosz.ros1.rospy.absent import attribute
from rosz.ros1.rospy.logs import LEVELS

__all__ = ()

_rospy_to_logging_levels = LEVELS

__getattr__ = attribute(__name__)
