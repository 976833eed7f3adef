"""A small TurtleBot3 on a flat floor: enough to drive, to look around, and to run into things.

``arena`` and ``robot`` are pure geometry; ``reports`` makes messages; the simulator is the node.
"""

from rosz.turtlebot3_sim.arena import ARENAS, Arena, Pillar, Wall
from rosz.turtlebot3_sim.robot import Robot

__all__ = ("ARENAS", "Arena", "Pillar", "Robot", "Wall")
