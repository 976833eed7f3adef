"""ROS 1's names over rosz; importing this package makes them importable in this process.

``import rosz.ros1`` and then ``import rospy``, ``from std_msgs.msg import String``, and so on. May
import everything below the command line.
"""

from __future__ import annotations

from rosz.ros1.importer import install

__all__ = ("install",)

install()
