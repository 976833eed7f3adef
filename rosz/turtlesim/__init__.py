"""Turtles that draw: ROS 1's turtlesim, with a window or without, and the programs around it.

``turtle``, ``world``, ``field``, ``shape`` and ``picture`` are pure: physics and pixels. The
simulator puts them on the network, the window and the snapshot show them.
"""

from rosz.turtlesim.snapshot import Picture, fetch
from rosz.turtlesim.turtle import Pen, Turtle
from rosz.turtlesim.world import World

__all__ = ("Pen", "Picture", "Turtle", "World", "fetch")
