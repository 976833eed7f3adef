"""A running simulation, and its observers."""

from __future__ import annotations

from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network

from rosz.msgs.turtlesim.msg import Pose
from rosz.node import Node
from rosz.turtlesim.simulator import Simulator


class Watcher:
    """The poses of a turtle."""

    def __init__(self, node: Node, name: str) -> None:
        self._poses: SimpleQueue[Pose] = SimpleQueue()
        node.subscription(f"{name}/pose", Pose, self._poses.put, queue_size=1000)

    def wait_for(self, condition: Callable[[Pose], Any] = lambda _: True) -> Pose:
        """Return the next pose that meets a condition."""
        for _ in range(int(TIMEOUT * 62.5)):
            pose = self._poses.get(timeout=TIMEOUT)
            if condition(pose):
                return pose
        pytest.fail(f"no such pose; the last was {pose}")


def wait_for_turtle(user: Node, name: str) -> None:
    """Wait until a node knows the services of a turtle."""
    user.context.graph.wait_for(
        lambda view: bool(view.servers(f"{name}/teleport_relative")), TIMEOUT, name
    )


class Scene:
    """A simulation and another node.

    Attributes:
        sim: Node of the simulation.
        user: Another node, on a session of its own.
    """

    def __init__(self, network: Network) -> None:
        self.sim = network.node("turtlesim")
        self.user = network.node("user")
        self.simulator = Simulator(self.sim)
        wait_for_turtle(self.user, "/turtle1")
        for name in ("clear", "kill", "reset", "spawn"):  # which come after those of the turtle
            self.user.context.graph.wait_for_service(f"/{name}", TIMEOUT)

    def call(self, name: str, service_type: Any, *values: Any) -> Any:
        """Call a service from the other node."""
        with self.user.client(name, service_type, timeout=TIMEOUT) as client:
            return client(*values)

    def watch(self, name: str = "turtle1") -> Watcher:
        """Observe the poses of a turtle."""
        return Watcher(self.user, name)


@pytest.fixture
def scene(network: Network) -> Scene:
    """A simulation with one turtle."""
    return Scene(network)
