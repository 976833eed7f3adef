"""``rospy.impl.tcpros_base``: nothing but a number that programs pass to subscribers."""

from __future__ import annotations

from rosz.ros1.rospy.absent import attribute
from rosz.ros1.rospy.topics import DEFAULT_BUFF_SIZE

__all__ = ("DEFAULT_BUFF_SIZE",)

__getattr__ = attribute(__name__)
