"""The actions of a network: listing and finding them, and their classes."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from rosz.errors import NotFoundError, near_miss
from rosz.graph import View
from rosz.message import Action
from rosz.node import Context, Node
from rosz.node.actions import FEEDBACK, RESULT, SEND
from rosz.node.ros2 import request_action
from rosz.wire import Kind, Token

_SUFFIX = f"/{SEND}"
_SERVICE = "_SendGoal"


class ActionEntry(msgspec.Struct, frozen=True):
    """An action.

    Attributes:
        name: Full name of the action.
        types: Names of its types; more than one is a fault.
        servers: Full names of the nodes that serve it.
        clients: Full names of the nodes that have a client of it.
    """

    name: str
    types: tuple[str, ...]
    servers: tuple[str, ...]
    clients: tuple[str, ...]


def list_actions(view: View) -> list[ActionEntry]:
    """Return the actions that nodes serve or use, sorted by name."""
    ends: dict[str, list[Token]] = {}
    for token in view.entities(Kind.SERVICE, Kind.CLIENT):
        if token.name.endswith(_SUFFIX):
            ends.setdefault(token.name.removesuffix(_SUFFIX), []).append(token)
    return [_entry(name, tokens) for name, tokens in sorted(ends.items())]


def _entry(name: str, tokens: Sequence[Token]) -> ActionEntry:
    def nodes(kind: Kind) -> tuple[str, ...]:
        return tuple(sorted({token.node_name for token in tokens if token.kind is kind}))

    types = sorted({token.type_name.removesuffix(_SERVICE) for token in tokens})
    return ActionEntry(name, tuple(types), nodes(Kind.SERVICE), nodes(Kind.CLIENT))


def describe_action(view: View, name: str) -> ActionEntry:
    """Return an action that is served or used.

    Raises:
        NotFoundError: No node serves or uses it.
    """
    entries = {entry.name: entry for entry in list_actions(view)}
    if name not in entries:
        raise NotFoundError(f"unknown action '{name}'{near_miss(name, entries)}")
    return entries[name]


def find_action(view: View, name: str) -> str:
    """Return the type of an action that is served.

    Raises:
        NotFoundError: No node serves it.
    """
    entry = describe_action(view, name)
    if not entry.servers:
        raise NotFoundError(f"action '{name}' has clients and no server")
    return view.servers(name + _SUFFIX)[0].type_name.removesuffix(_SERVICE)


def view_of_action(context: Context, name: str) -> View:
    """Return a view of the graph that has the server of an action.

    Raises:
        NotFoundError: No node serves it.
    """

    def look(view: View) -> View:
        find_action(view, name)
        return view

    return context.graph.find(look)


def wait_for_action(context: Context, name: str, timeout: float) -> View:
    """Return a view of the graph that has the server of an action, and wait while there is none.

    Args:
        context: The context whose graph is watched.
        name: Full name of the action.
        timeout: Time limit in seconds.

    Raises:
        WaitTimeout: No node served it in time.
        ClosedError: The context is shut down meanwhile.
    """
    return context.graph.wait_for(
        lambda view: bool(view.servers(name + _SUFFIX)), timeout, f"server of action '{name}'"
    )


def action_type(node: Node, view: View, name: str) -> type[Action]:
    """Return the class of an action that is served; its server describes one unknown here.

    Args:
        node: Node that requests the description.
        view: What is known of the graph.
        name: Full name of the action.

    Raises:
        NotFoundError: No node serves it, or the server cannot describe it.
        WaitTimeout: The server did not respond in time.
        ServiceError: The server ended before it responded.
    """
    type_name = find_action(view, name)
    entities = [
        *view.servers(f"{name}/{SEND}")[:1],
        *view.servers(f"{name}/{RESULT}")[:1],
        *view.publishers(f"{name}/{FEEDBACK}")[:1],
    ]
    return request_action(node, type_name, entities)
