"""roslib: what programs of before catkin import first (ROS wiki, roslib)."""

from rosz.ros1.roslib import message, names, packages
from rosz.ros1.roslib.launcher import load_manifest

__all__ = ("load_manifest", "message", "names", "packages")
