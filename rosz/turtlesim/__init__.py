"""Turtles that draw: ROS 1's turtlesim, with or without a window, and its other programs.

`world` and `picture` are pure: physics and pixels. `simulator` is the node. `snapshot`,
which serves and fetches pictures, and the programs `program`, `teleop` and `drivers` are public
modules, because each is loaded alone.
"""

from rosz.turtlesim.snapshot import Picture, fetch
from rosz.turtlesim.world import Pen, Turtle, World

PUBLIC_MODULES = ("teleop",)

__all__ = ("Pen", "Picture", "Turtle", "World", "fetch")
