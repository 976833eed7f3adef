"""``rospy.impl.tcpros_service``: services, where some programs import them from."""

from __future__ import annotations

from rosz.ros1.rospy.absent import attribute
from rosz.ros1.rospy.proxy import ServiceProxy, wait_for_service
from rosz.ros1.rospy.service import Service, ServiceException

__all__ = ("Service", "ServiceException", "ServiceProxy", "wait_for_service")

__getattr__ = attribute(__name__)
