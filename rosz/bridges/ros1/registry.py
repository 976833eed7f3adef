"""What ROS 1's programs have registered at the master: a table of values."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import msgspec

__all__ = ("ANY_TYPE", "Change", "Entry", "Registered", "Registry", "Role")

Role = Literal["publisher", "subscriber", "service", "param"]
"""What a node is registered for; ``param`` are updates of a parameter."""

ANY_TYPE = "*"
"""The type of a subscriber that takes every type."""


class Entry(msgspec.Struct, frozen=True):
    """One registration.

    Attributes:
        role: What the node is registered for.
        name: Global name of the topic, service or parameter.
        node: Full name of the node.
        uri: URI of the node's XML-RPC server.
        type_name: Type of the topic, or ``*``; empty for services and parameters.
        service_uri: URI of the service, such as ``rosrpc://host:port``.
    """

    role: Role
    name: str
    node: str
    uri: str
    type_name: str = ""
    service_uri: str = ""


class Change(msgspec.Struct, frozen=True):
    """A registration that has come or gone.

    Attributes:
        entry: The registration.
        alive: Whether it has come.
    """

    entry: Entry
    alive: bool


class Registered(msgspec.Struct, frozen=True):
    """The effect of a registration.

    Attributes:
        changes: Registrations that have gone, and the one that has come.
        replaced: URI of an older node of the same name, which is to be shut down; empty if there
            is none.
    """

    changes: list[Change]
    replaced: str = ""


class Registry:
    """Registrations by role and name. Not safe for threads."""

    def __init__(self) -> None:
        self._entries: dict[tuple[Role, str], dict[str, Entry]] = {}
        self._nodes: dict[str, dict[tuple[Role, str], Entry]] = {}
        self._uris: dict[str, str] = {}
        self._types: dict[str, str] = {}

    def register(self, entry: Entry) -> Registered:
        """Add a registration.

        A node that registers from another URI is a new one of the same name, so everything that
        the old one has registered goes. A service has one provider, the newest.
        """
        changes: list[Change] = []
        replaced = ""
        known = self._uris.get(entry.node)
        if known is not None and known != entry.uri:
            replaced = known
            changes += self.remove_node(entry.node)
        place = entry.role, entry.name
        others = self._entries.setdefault(place, {})
        if entry.role == "service":
            for other in [other for other in others.values() if other.node != entry.node]:
                changes += self._remove(other)
            others = self._entries.setdefault(place, {})
        before = others.get(entry.node)
        self._learn_type(entry)
        if before != entry:
            if before is not None:
                changes.append(Change(before, alive=False))
            changes.append(Change(entry, alive=True))
            others[entry.node] = entry
            self._nodes.setdefault(entry.node, {})[place] = entry
            self._uris[entry.node] = entry.uri
        return Registered(changes, replaced)

    def unregister(self, role: Role, name: str, node: str, uri: str) -> list[Change]:
        """Remove a registration.

        Args:
            role: Its role.
            name: Its name.
            node: Full name of the node.
            uri: URI of the node, or of the service; another one removes nothing, because it is that
                of an older node of the same name.

        Returns:
            What has changed; empty if there was no such registration.
        """
        entry = self._entries.get((role, name), {}).get(node)
        if entry is None or uri != (entry.service_uri or entry.uri):
            return []
        return self._remove(entry)

    def remove_node(self, node: str) -> list[Change]:
        """Remove everything that a node has registered."""
        changes = []
        for entry in list(self._nodes.get(node, {}).values()):
            changes += self._remove(entry)
        return changes

    def _remove(self, entry: Entry) -> list[Change]:
        place = entry.role, entry.name
        others = self._entries[place]
        del others[entry.node]
        if not others:
            del self._entries[place]
            topic = entry.name
            if not any((role, topic) in self._entries for role in ("publisher", "subscriber")):
                self._types.pop(topic, None)
        mine = self._nodes[entry.node]
        del mine[place]
        if not mine:
            del self._nodes[entry.node], self._uris[entry.node]
        return [Change(entry, alive=False)]

    def _learn_type(self, entry: Entry) -> None:
        """Note the type of a topic: that of its publishers, or else of its first subscriber."""
        if not entry.type_name or entry.type_name == ANY_TYPE:
            return
        if entry.role == "publisher":
            self._types[entry.name] = entry.type_name
        elif entry.role == "subscriber":
            self._types.setdefault(entry.name, entry.type_name)

    def entries(self, role: Role, name: str) -> list[Entry]:
        """Return the registrations for a name, oldest first."""
        return list(self._entries.get((role, name), {}).values())

    def by_name(self, role: Role) -> dict[str, list[str]]:
        """Return the nodes of each name of a role."""
        return {name: list(known) for (each, name), known in self._entries.items() if each == role}

    def types(self) -> dict[str, str]:
        """Return the types of topics, as far as anybody has told them."""
        return dict(self._types)

    def uri(self, node: str) -> str:
        """Return the URI of a node; empty if it has registered nothing."""
        return self._uris.get(node, "")

    def nodes(self) -> dict[str, str]:
        """Return the URIs of all nodes by name."""
        return dict(self._uris)

    def dump(self) -> list[Entry]:
        """Return all registrations, oldest first for each name."""
        return [entry for known in self._entries.values() for entry in known.values()]

    def load(self, entries: Iterable[Entry]) -> list[Change]:
        """Add registrations that another table had; return what has changed."""
        return [change for entry in entries for change in self.register(entry).changes]
