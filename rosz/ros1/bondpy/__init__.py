"""bondpy: two processes that notice when the other one ends (ROS wiki, bondpy).

May import rospy and message classes.
"""

from __future__ import annotations

from rosz.ros1.bondpy import bondpy

PUBLIC_MODULES = ("bondpy",)

__all__ = ("bondpy",)
