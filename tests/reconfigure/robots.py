"""A node with settings of every kind, for tests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rosz.node import Node
from rosz.reconfigure import Choice, Config, Description, Group, Server, Setting, enumeration

SIZES = enumeration(
    [Choice("Small", 0, "A small one"), Choice("Large", 2, "A large one")], "How large"
)

ROBOT = Description(
    (
        Setting("gain", 0.5, "Gain of the loop", 1, min=0, max=10),
        Setting("steps", 50, "Number of steps", 2, min=0, max=100),
        Setting("label", "hello", "What it is called", 4),
        Setting("enabled", True, "Whether it runs", 8),
        Setting("size", 0, "How large it is", 16, min=0, max=2, edit_method=SIZES),
    ),
    (
        Group(
            "Filter",
            (Setting("cutoff", 2.5, "Hertz", 32),),
            (Group("Deep", (Setting("taps", 3, level=64),), type="tab"),),
            type="collapse",
            state=False,
        ),
        Group("Other"),
    ),
)


class Robot:
    """A server that remembers what it was asked."""

    def __init__(self, node: Node, namespace: str = "", **options: Any) -> None:
        self.calls: list[tuple[Config, int]] = []
        self.answer: Mapping[str, Any] = {}
        self.server = Server(node, ROBOT, self._decide, namespace, **options)

    def _decide(self, config: Config, level: int) -> Config:
        self.calls.append((config, level))
        config.update(self.answer)
        return config

    @property
    def levels(self) -> list[int]:
        """The levels that it was called with."""
        return [level for _, level in self.calls]
