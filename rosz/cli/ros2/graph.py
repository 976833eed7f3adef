"""The network as ROS 2's commands see it, and the node with which they take part.

Every node of ROS 2 serves its parameters and publishes ``/rosout`` and ``/parameter_events``. A
node of rosz does so only when somebody asks for them, but is always shown with them. The node of
the command itself is hidden in lists, and counts as a publisher.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from rosz.cli.call import Call
from rosz.cli.console import print_error
from rosz.errors import RoszError, TransportError
from rosz.graph import View
from rosz.qos import PARAMETERS, ROSOUT, SERVICES, QoS
from rosz.wire import Kind, Token, is_rosz_id

if TYPE_CHECKING:
    from rosz.node import Context, Node

_EVENTS = "/parameter_events"
_TOPICS = {
    "/rosout": ("rcl_interfaces/msg/Log", ROSOUT),
    _EVENTS: ("rcl_interfaces/msg/ParameterEvent", PARAMETERS),
}
_SERVICES = {
    **{
        name: f"rcl_interfaces/srv/{''.join(map(str.title, name.split('_')))}"
        for name in (
            "describe_parameters",
            "get_parameter_types",
            "get_parameters",
            "list_parameters",
            "set_parameters",
            "set_parameters_atomically",
        )
    },
    "get_type_description": "type_description_interfaces/srv/GetTypeDescription",
}
NODE_NAME = f"_ros2cli_{os.getpid()}"


class CommandFailed(RoszError):
    """A command of ``ros2`` cannot do what it was asked; the text is that of ROS 2's command."""


def is_hidden(name: str) -> bool:
    """Return whether a name is left out of lists: a part of it begins with an underscore."""
    return "/_" in name


def visible_nodes(view: View, *, hidden: bool) -> list[str]:
    """Return the sorted full names of nodes, with or without hidden ones."""
    return [name for name in view.nodes() if hidden or not is_hidden(name)]


def read_view() -> View:
    """Return the graph; if no process answers, print a warning: it then has only the own node."""
    call = Call()
    tokens: tuple[Token, ...] = ()
    try:
        tokens = call.survey().view.tokens
    except TransportError as error:
        print_error(f"WARNING: {error}")
    own = Token(call.domain, "0", 0, 0, Kind.NODE, "/", NODE_NAME)
    return View([*tokens, *_standard(own, topics_only=True), own, *_missing_standard(tokens)])


def _missing_standard(tokens: Iterable[Token]) -> Iterator[Token]:
    """Yield the tokens that nodes of rosz lack, but will have when somebody asks for them."""
    nodes = {(t.zid, t.node_id): t for t in tokens if is_rosz_id(t.zid)}
    present = {(token.zid, token.node_id, token.kind, token.name) for token in tokens}
    for node in nodes.values():
        for token in _standard(node):
            if (token.zid, token.node_id, token.kind, token.name) not in present:
                yield token


def _standard(node: Token, *, topics_only: bool = False) -> Iterator[Token]:
    """Yield the tokens of the topics and services that every node of ROS 2 has."""

    def make(kind: Kind, name: str, type_name: str, qos: QoS) -> Token:
        place = (node.domain, node.zid, node.node_id, 0, kind, node.namespace, node.node)
        return Token(*place, name=name, type_name=type_name, qos=qos)

    for name, (type_name, qos) in _TOPICS.items():
        yield make(Kind.PUBLISHER, name, type_name, qos)
    for name, type_name in () if topics_only else _SERVICES.items():
        yield make(Kind.SERVICE, f"{node.node_name}/{name}", type_name, SERVICES)


@contextmanager
def open_node(name: str | None = None, *, lasting: bool = False) -> Iterator[Node]:
    """Open the node of a command; Ctrl-C then raises `KeyboardInterrupt`.

    Args:
        name: Base name; a hidden one when not given.
        lasting: Whether the command runs until it is stopped.
    """
    from rosz.cli.console import until_stopped
    from rosz.node import Node

    with (
        until_stopped() as ready,
        _context(lasting=lasting) as context,
        Node(name or NODE_NAME, context=context) as node,
    ):
        ready()
        yield node
        return
    raise KeyboardInterrupt


def _context(*, lasting: bool) -> Context:
    """Return a context; without other processes, one that waits for them, as that of any node."""
    from rosz.introspect import open_context
    from rosz.node import Context

    call = Call()
    with suppress(TransportError):
        return open_context(call.environment, lasting=lasting)
    return Context(call.environment)


def wait_until(context: Context, condition: Callable[[View], bool], what: str) -> View:
    """Wait until the graph meets a condition, as long as that takes, and return it."""
    import threading

    return context.graph.wait_for(condition, threading.TIMEOUT_MAX / 2, what)
