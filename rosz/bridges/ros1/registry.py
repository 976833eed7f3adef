"""The table of the registrations of ROS 1's programs at the master."""

from __future__ import annotations

import threading
from typing import Literal

import msgspec

Role = Literal["publisher", "subscriber", "service", "param"]
"""The role of a registration; ``param`` means a subscription to a parameter."""

ANY_TYPE = "*"
"""The type that a subscriber registers to accept every type."""


class RegistryEntry(msgspec.Struct, frozen=True):
    """One registration.

    Attributes:
        role: Role of the node.
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
    """A registration that was added or removed."""

    entry: RegistryEntry
    alive: bool


class Registry:
    """Registrations by role and name.

    Attributes:
        lock: Is held while the table is read, and by those who change it.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self._entries: dict[tuple[Role, str], dict[str, RegistryEntry]] = {}
        self._nodes: dict[str, dict[tuple[Role, str], RegistryEntry]] = {}
        self._uris: dict[str, str] = {}
        self._types: dict[str, str] = {}

    def register(self, entry: RegistryEntry) -> list[Change]:
        """Add a registration, and return the changes: removed registrations, then the new one.

        A node that registers with another URI replaces the node that had its name, so the
        registrations of the old node are removed. A service has only its newest provider.
        """
        changes: list[Change] = []
        if self.uri(entry.node) not in {"", entry.uri}:
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
        return changes

    def unregister(self, role: Role, name: str, node: str, uri: str) -> list[Change]:
        """Remove a registration.

        Args:
            role: Role of the registration.
            name: Name of the topic, service or parameter.
            node: Full name of the node.
            uri: URI of the node, or of the service; another URI belongs to an older node of the
                same name, and removes nothing.

        Returns:
            The changes; empty if no registration matches.
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

    def _remove(self, entry: RegistryEntry) -> list[Change]:
        place = entry.role, entry.name
        others = self._entries[place]
        del others[entry.node]
        if not others:
            del self._entries[place]
            topic = entry.name
            if not any((role, topic) in self._entries for role in ("publisher", "subscriber")):
                self._types.pop(topic, None)
        own = self._nodes[entry.node]
        del own[place]
        if not own:
            del self._nodes[entry.node], self._uris[entry.node]
        return [Change(entry, alive=False)]

    def _learn_type(self, entry: RegistryEntry) -> None:
        """Store the type of a topic; types of publishers replace types of subscribers."""
        if not entry.type_name or entry.type_name == ANY_TYPE:
            return
        if entry.role == "publisher":
            self._types[entry.name] = entry.type_name
        elif entry.role == "subscriber":
            self._types.setdefault(entry.name, entry.type_name)

    def entries(self, role: Role, name: str) -> list[RegistryEntry]:
        """Return the registrations for a name, oldest first."""
        with self.lock:
            return list(self._entries.get((role, name), {}).values())

    def by_name(self, role: Role) -> dict[str, list[str]]:
        """Return the nodes that are registered in a role, by name."""
        with self.lock:
            return {
                name: list(entries)
                for (entry_role, name), entries in self._entries.items()
                if entry_role == role
            }

    def types(self) -> dict[str, str]:
        """Return the known types of topics, by topic."""
        with self.lock:
            return dict(self._types)

    def uri(self, node: str) -> str:
        """Return the URI of a node; empty if it has registered nothing."""
        with self.lock:
            return self._uris.get(node, "")

    def nodes(self) -> dict[str, str]:
        """Return the URIs of all nodes by name."""
        with self.lock:
            return dict(self._uris)

    def dump(self) -> list[RegistryEntry]:
        """Return all registrations, oldest first for each name."""
        with self.lock:
            return [entry for entries in self._entries.values() for entry in entries.values()]
