"""Services as rosservice lists and describes them."""

from __future__ import annotations

import msgspec

from rosz.errors import NotFoundError, near_miss
from rosz.graph import View
from rosz.introspect.survey import ros1_type
from rosz.wire import Token, endpoint_key

__all__ = ("ServiceEntry", "find", "list_services", "server", "uri")


class ServiceEntry(msgspec.Struct, frozen=True):
    """A service that is served.

    Attributes:
        name: Its name.
        types: Names of its types, as ROS 1 spells them; more than one is a fault of somebody.
        nodes: Full names of the nodes that serve it.
    """

    name: str
    types: tuple[str, ...]
    nodes: tuple[str, ...]


def list_services(view: View) -> list[ServiceEntry]:
    """Return the services that somebody serves, sorted by name."""
    entries: list[ServiceEntry] = []
    for name, types in view.services().items():
        nodes = tuple(sorted({token.node_name for token in view.servers(name)}))
        entries.append(ServiceEntry(name, tuple(map(ros1_type, types)), nodes))
    return entries


def find(view: View, type_name: str) -> list[str]:
    """Return the names of the services of a type, which may be spelled as in ROS 1 or 2."""
    wanted = ros1_type(type_name)
    return [entry.name for entry in list_services(view) if wanted in entry.types]


def server(view: View, name: str) -> Token:
    """Return who serves a service, the first of several.

    Raises:
        NotFoundError: Nobody does.
    """
    servers = view.servers(name)
    if not servers:
        raise NotFoundError(f"unknown service '{name}'{near_miss(name, view.services())}")
    return servers[0]


def uri(token: Token) -> str:
    """Return where a service is called: its key expression on Zenoh."""
    return endpoint_key(token.domain, token.name, token.type_name, token.type_hash)
