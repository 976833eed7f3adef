"""ros2cli.node.strategy and ros2topic.api: what programs import of ROS 2's commands."""

from __future__ import annotations

import os
from typing import Any

from rosz.ros2.rclpy.context import Context
from rosz.ros2.rclpy.node import Node


class NodeStrategy:
    """A hidden node of a command, for a ``with`` block; arguments of the command are ignored."""

    def __init__(self, *_args: Any, **_options: Any) -> None:
        self._context = Context()

    def __enter__(self) -> Node:
        self._context.init([])
        return Node(f"_ros2cli_{os.getpid()}", context=self._context)

    def __exit__(self, *_details: object) -> None:
        self._context.shutdown()


def get_topic_names_and_types(
    *, node: Node, include_hidden_topics: bool = False
) -> list[tuple[str, list[str]]]:
    """Return the topics with their types, without those with a part that begins with ``_``."""
    topics = node.get_topic_names_and_types()
    return [topic for topic in topics if include_hidden_topics or "/_" not in topic[0]]
