"""Turtles that draw: ROS 1's turtlesim, with or without a window, and its other programs.

`world` and `picture` are pure: physics and pixels. `simulator` is the node. `snapshot`,
which serves and fetches pictures, and the programs `program`, `teleop` and `drivers` are public
modules, because each is loaded alone.
"""

from rosz.turtlesim.snapshot import Snapshot, fetch

PUBLIC_MODULES = ("teleop",)
