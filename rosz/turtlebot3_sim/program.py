"""The program ``turtlebot3_sim``."""

from __future__ import annotations

from rosz.node import Node
from rosz.turtlebot3_sim.simulator import Simulator

__all__ = ("main",)


def main() -> None:
    """Simulate until told to end."""
    with Node("turtlebot3_sim") as node:
        node.context.cooperative = True
        Simulator(node)
        node.spin()
