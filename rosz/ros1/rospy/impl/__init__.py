"""The inside of rospy, as far as programs reach into it; what is absent says so by name."""

from __future__ import annotations

from rosz.ros1.rospy.absent import attribute

__all__ = ()

__getattr__ = attribute(
    __name__,
    {
        name: f"rosz.ros1.rospy.impl.{name}"
        for name in ("rosout", "tcpros", "tcpros_base", "tcpros_service")
    },
)
