"""rostest: tests that are nodes (ROS wiki, rostest).

``rosz launch`` starts ``.test`` files; the parts of rostest that do so in ROS 1 are missing.
"""

from __future__ import annotations

from rosz.ros1.state import survey
from rosz.ros1.tools.rosgraph.names import script_resolve_name
from rosz.ros1.tools.rosunit import rosrun, unitrun
from rosz.wire import Kind

__all__ = ("is_publisher", "is_subscriber", "rosrun", "run", "unitrun")

_TOOL = "rostest"

run = rosrun


def is_subscriber(topic: str, subscriber_id: str) -> bool:
    """Return whether a node subscribes to a topic."""
    return _has(Kind.SUBSCRIPTION, topic, subscriber_id)


def is_publisher(topic: str, publisher_id: str) -> bool:
    """Return whether a node publishes on a topic."""
    return _has(Kind.PUBLISHER, topic, publisher_id)


def _has(kind: Kind, topic: str, node: str) -> bool:
    name, full_name = script_resolve_name(_TOOL, topic), script_resolve_name(_TOOL, node)
    return any(token.node_name == full_name for token in survey().view.entities(kind, name=name))
