"""Nodes with a lifecycle: their states and transitions."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING, Any

from rosz.cli.console import print_error, print_lines
from rosz.cli.ros2.graph import CommandFailed, open_node, read_view, visible_nodes
from rosz.errors import RoszError

if TYPE_CHECKING:
    from rosz.graph import View
    from rosz.node import Node

_TYPE = "lifecycle_msgs/srv/GetState"


def _names(view: View, given: Namespace) -> list[str]:
    names = visible_nodes(view, hidden=given.hidden)
    services = view.services()
    return sorted({name for name in names if _TYPE in services.get(f"{name}/get_state", ())})


def _call(node: Node, name: str, service: str, kind: str, *values: Any) -> Any:
    from rosz.msgs.lifecycle_msgs import srv

    try:
        with node.client(f"{name}/{service}", getattr(srv, kind)) as client:
            return client(*values)
    except RoszError as error:
        raise CommandFailed(f"Exception while calling service of node '{name}': {error}") from error


def _checked(given: Namespace) -> str:
    """Return the full name of the node that the command line names."""
    name = f"/{given.node.removeprefix('/')}"
    if name not in _names(read_view(), given):
        raise CommandFailed("Node not found")
    return name


def nodes(given: Namespace) -> None:
    """List the nodes that have a lifecycle."""
    names = _names(read_view(), given)
    print_lines([str(len(names))] if given.count else names)


def get(given: Namespace) -> None:
    """Print the state of a node, or of all nodes."""
    names = [_checked(given)] if given.node else _names(read_view(), given)
    with open_node() as node:
        for name in names:
            try:
                state = _call(node, name, "get_state", "GetState").current_state
            except CommandFailed as error:
                if given.node:
                    raise
                print_error(str(error))
                continue
            prefix = "" if given.node else f"{name}: "
            print_lines([f"{prefix}{state.label} [{state.id}]"])


def _transitions(node: Node, name: str, *, every: bool = False) -> list[Any]:
    service = "get_transition_graph" if every else "get_available_transitions"
    response = _call(node, name, service, "GetAvailableTransitions")
    return list(response.available_transitions)


def transitions(given: Namespace) -> None:
    """List the transitions of a node."""
    name = _checked(given)
    with open_node() as node:
        for each in _transitions(node, name, every=given.all):
            print_lines(
                [
                    f"- {each.transition.label} [{each.transition.id}]",
                    f"\tStart: {each.start_state.label}",
                    f"\tGoal: {each.goal_state.label}",
                ]
            )


def change(given: Namespace) -> str | None:
    """Let a node make a transition."""
    name = _checked(given)
    with open_node() as node:
        there = [each.transition for each in _transitions(node, name)]
        by_name = {str(each.id): each for each in there} | {each.label: each for each in there}
        if given.transition not in by_name:
            rows = "".join(f"\n- {each.label} [{each.id}]" for each in there)
            return f"Unknown transition requested, available ones are:{rows}"
        done = _call(node, name, "change_state", "ChangeState", by_name[given.transition]).success
    if done:
        print_lines(["Transitioning successful"])
    else:
        print_error("Transitioning failed")
    return None
