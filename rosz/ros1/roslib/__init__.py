"""roslib: packages, and definitions of types, for programs older than rospkg (ROS wiki, roslib).

It may import floors 0 to 2 and the modules of ROS 1 below it: ``genmsg`` and ``rospkg``.
"""

from __future__ import annotations

from types import ModuleType

from rosz.ros1.roslib import packages
from rosz.ros1.roslib.packages import load_manifest

__all__ = ("load_manifest", "message", "names", "packages")

message: ModuleType  # built by the importer, as the next one
names: ModuleType
