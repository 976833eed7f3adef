"""roslib: packages, and definitions of types, for programs older than rospkg (ROS wiki, roslib).

It may import floors 0 to 2 and the modules of ROS 1 below it: ``genmsg`` and ``rospkg``.
"""

from __future__ import annotations

from types import ModuleType

from rosz.ros1.tools.roslib import packages
from rosz.ros1.tools.roslib.packages import is_interactive, load_manifest, set_interactive

__all__ = (
    "is_interactive",
    "load_manifest",
    "message",
    "names",
    "packages",
    "set_interactive",
)

message: ModuleType  # built by the importer, as the next one
names: ModuleType
