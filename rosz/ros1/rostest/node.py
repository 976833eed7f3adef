"""What test nodes ask: whether others are there, and to be run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rosz.ros1.rosgraph import live
from rosz.ros1.rosgraph.names import script_resolve_name
from rosz.ros1.rosunit import unitrun
from rosz.wire import Kind

__all__ = ("is_publisher", "is_subscriber", "rosrun", "run", "unitrun")

_TOOL = "rostest"


def rosrun(package: str, test_name: str, test: Any, sysargs: Sequence[str] | None = None) -> None:
    """Run a test case, write its results, and end the program if it failed.

    Args:
        package: The package that the test belongs to.
        test_name: Name of the test.
        test: A class of test cases, or the name of a module, class or method.
        sysargs: Command line; that of the process when not given.

    Raises:
        SystemExit: With code 1, if a test failed.
    """
    unitrun(package, test_name, test, sysargs)


run = rosrun


def is_subscriber(topic: str, subscriber_id: str) -> bool:
    """Tell whether a node subscribes to a topic."""
    return _has(Kind.SUBSCRIPTION, topic, subscriber_id)


def is_publisher(topic: str, publisher_id: str) -> bool:
    """Tell whether a node publishes on a topic."""
    return _has(Kind.PUBLISHER, topic, publisher_id)


def _has(kind: Kind, topic: str, node: str) -> bool:
    name, who = script_resolve_name(_TOOL, topic), script_resolve_name(_TOOL, node)
    found = live.survey().view.entities(kind, name=name)
    return any(token.node_name == who for token in found)
