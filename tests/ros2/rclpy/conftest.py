"""The network of a test for nodes of rclpy, and a node with its executor."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from network import Network, eventually

from rosz.ros2.rclpy import executors
from rosz.ros2.rclpy.context import Context
from rosz.ros2.rclpy.node import Node

Start = Callable[..., Context]


@pytest.fixture
def start(network: Network, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Return a function that opens contexts on the network of the test."""
    for name, value in network.variables().items():
        monkeypatch.setenv(name, value)
    opened: list[Context] = []

    def begin(*args: str) -> Context:
        context = Context()
        context.init(["program", *args])
        opened.append(context)
        return context

    yield begin
    for context in opened:
        context.shutdown()


class World:
    """A node and its executor."""

    def __init__(self, start: Start, name: str = "robot", *args: str, **options: Any) -> None:
        self.context = start(*args)
        self.node = Node(name, context=self.context, **options)
        self.executor = executors.SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def spin_until(self, condition: Callable[[], object], what: str) -> None:
        def look() -> object:
            self.executor.spin_once(timeout_sec=0.01)
            return condition()

        eventually(look, what)


@pytest.fixture
def world(start: Start) -> World:
    return World(start)
