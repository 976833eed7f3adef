"""Services: listing, finding and calling them as rosservice does."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.errors import NotFoundError, near_miss
from rosz.names import is_of_action, short_type
from rosz.wire import Token, entity_key

if TYPE_CHECKING:
    from rosz.graph import View
    from rosz.node import Client, Context


class ServiceEntry(msgspec.Struct, frozen=True):
    """A service.

    Attributes:
        name: Full name of the service.
        types: Names of its types, as ROS 1 spells them; more than one is a fault.
        nodes: Full names of the nodes that serve it.
    """

    name: str
    types: tuple[str, ...]
    nodes: tuple[str, ...]


def list_services(view: View) -> list[ServiceEntry]:
    """Return the services that nodes serve, sorted by name; without those of ROS 2's actions."""
    entries: list[ServiceEntry] = []
    for name, types in view.services().items():
        if is_of_action(name):
            continue
        nodes = tuple(sorted({token.node_name for token in view.servers(name)}))
        entries.append(ServiceEntry(name, tuple(map(short_type, types)), nodes))
    return entries


def services_of_type(view: View, type_name: str) -> list[str]:
    """Return the names of the services of a type, in ROS 1's or ROS 2's spelling."""
    wanted = short_type(type_name)
    return [entry.name for entry in list_services(view) if wanted in entry.types]


def find_server(view: View, name: str) -> Token:
    """Return the token of the server of a service, the first of several.

    Raises:
        NotFoundError: No node serves it.
    """
    servers = view.servers(name)
    if not servers:
        raise NotFoundError(f"unknown service '{name}'{near_miss(name, view.services())}")
    return servers[0]


def service_key(token: Token) -> str:
    """Return the Zenoh key expression that a service is called on."""
    return entity_key(token.domain, token.name, token.type_name, token.type_hash)


def wait_for_server(context: Context, name: str, warn: Callable[[str], object]) -> Token:
    """Return the token of the server of a service, and wait while there is none.

    Args:
        context: The context whose graph is watched.
        name: Full name of the service.
        warn: Function called with a sentence if it has to wait.

    Raises:
        ClosedError: The context is shut down meanwhile.
    """
    try:
        return context.graph.find(lambda view: find_server(view, name))
    except NotFoundError as error:
        warn(f"service [{name}] is not there yet ({error})")
    return find_server(context.graph.wait_for_service(name, threading.TIMEOUT_MAX / 2), name)


def call_service(client: Client, values: Sequence[Any], now: int) -> tuple[Any, Any]:
    """Call a service with values from a command line, and return request and response.

    Args:
        client: Client of the service.
        values: One dictionary of fields, or a value for each field.
        now: ROS time in nanoseconds, for ``now`` and ``auto``.

    Raises:
        EncodeError: The values do not fit the request.
        RoszError: The call fails.
    """
    from rosz.introspect.arguments import make_message

    request = make_message(client.service_type.Request, values, now)
    return request, client.call(request)
