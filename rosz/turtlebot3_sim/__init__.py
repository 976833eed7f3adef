"""A small TurtleBot3 on a flat floor, with a laser and obstacles.

`world` is pure geometry; `simulator` is the node and the program.
"""

from rosz.turtlebot3_sim.world import ARENAS, Arena, Pillar, Robot, Wall

__all__ = ("ARENAS", "Arena", "Pillar", "Robot", "Wall")
