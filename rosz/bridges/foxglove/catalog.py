"""The catalog of topics, services and connections that clients receive.

The network is followed while there are clients. One thread compares the network with the catalog
and sends the difference to all clients, so that each client receives changes in their order. Other
threads request the definitions of unknown types.
"""

from __future__ import annotations

import itertools
import threading
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any, Protocol

import msgspec

from rosz.access import AccessPolicy, Verb
from rosz.errors import NotFoundError, RoszError
from rosz.graph import Followed, View
from rosz.lifecycle import Closable, Registration
from rosz.node import Node
from rosz.node.ros2 import request_type
from rosz.wire import NO_HASH, Kind, Token
from rosz.worker import Worker

_GATHER_SECONDS = 0.05
"""Time for which changes are collected, since a node declares many entities at once."""

_REQUESTS = 4
_Key = tuple[str, str, str]
_Graph = dict[str, dict[str, list[str]]]
"""Nodes by kind of entity and name of topic or service."""

_OBJECTS = {Kind.PUBLISHER: "topics", Kind.SUBSCRIPTION: "topics", Kind.SERVICE: "services"}


class CatalogMember(Protocol):
    """A client, as the catalog and the parameters see it."""

    def send(self, value: Mapping[str, Any]) -> None:
        """Send a message."""

    def report(self, text: str) -> None:
        """Send an error."""

    def drop_channels(self, channels: Iterable[int]) -> None:
        """End the subscriptions of channels that no longer exist."""


class AdvertisedChannel(msgspec.Struct, frozen=True):
    """A topic of one type, or a service.

    Attributes:
        id: Number for clients; a channel with another definition gets another number.
        name: Full name of the topic or service.
        kind: Class of the messages, or of the service.
    """

    id: int
    name: str
    kind: type[Any]

    def describe_topic(self) -> dict[str, Any]:
        """Return the description of the topic for clients."""
        return {"id": self.id, "topic": self.name, **_describe(self.kind)}

    def describe_service(self) -> dict[str, Any]:
        """Return the description of the service for clients."""
        return {
            "id": self.id,
            "name": self.name,
            "type": self.kind._type_name,
            "request": _describe(self.kind.Request),
            "response": _describe(self.kind.Response),
        }


class _Listing(msgspec.Struct, eq=False):
    """The channels of either topics or services that clients were told of."""

    _op: str
    _member: str
    _describe: Callable[[AdvertisedChannel], dict[str, Any]]
    _numbers: itertools.count[int] = msgspec.field(default_factory=partial(itertools.count, 1))
    channels: dict[_Key, AdvertisedChannel] = msgspec.field(default_factory=dict)
    by_number: dict[int, AdvertisedChannel] = msgspec.field(default_factory=dict)

    def add(self, key: _Key, kind: type[Any]) -> AdvertisedChannel:
        """Add a channel, with a new number."""
        channel = self.channels[key] = AdvertisedChannel(next(self._numbers), key[0], kind)
        self.by_number[channel.id] = channel
        return channel

    def retain(self, wanted: Mapping[_Key, Token]) -> list[int]:
        """Remove the channels that are not wanted any more; return their numbers."""
        gone = [self.channels.pop(key) for key in list(self.channels) if key not in wanted]
        return [self.by_number.pop(channel.id).id for channel in gone]

    def announce(self, channels: Iterable[AdvertisedChannel]) -> dict[str, Any]:
        """Return the message that advertises channels to clients."""
        return {
            "op": f"advertise{self._op}",
            f"{self._member}s": [self._describe(channel) for channel in channels],
        }

    def withdraw(self, numbers: list[int]) -> dict[str, Any]:
        """Return the message that tells clients which channels no longer exist."""
        single = "channel" if not self._op else self._member
        return {"op": f"unadvertise{self._op}", f"{single}Ids": numbers}


class NetworkCatalog:
    """The topics, services and connections of a network, followed while there are members.

    Args:
        hidden: Whether to show names of which a part begins with ``_``.
        services: Whether clients may call services.
    """

    def __init__(self, node: Node, policy: AccessPolicy, *, hidden: bool, services: bool) -> None:
        self._node = node
        self._policy = policy
        self._hidden = hidden
        self._lock = threading.Lock()
        self._worker = Worker[Callable[[], object]]("rosz-foxglove-catalog", logger=node.log)
        self._types = RequestedTypes(node, self._worker.submit, self._update, self._report)
        self._members: set[CatalogMember] = set()
        self._watchers: set[CatalogMember] = set()
        self._pending = False
        self._followed: Followed | None = None
        self._listening: Closable | None = None
        self._topics = _Listing("", "channel", AdvertisedChannel.describe_topic)
        self._services = _Listing("Services", "service", AdvertisedChannel.describe_service)
        self._listings = (self._topics, self._services) if services else (self._topics,)
        self._connections = ConnectionGraph(self._is_in_graph)

    def join(self, member: CatalogMember) -> None:
        """Send the whole catalog to a client, and from now on its changes."""
        self._worker.submit(partial(self._join, member))

    def leave(self, member: CatalogMember) -> None:
        """Send nothing more to a client; after the last client, stop following the network."""
        self._worker.submit(partial(self._leave, member))

    def watch(self, member: CatalogMember) -> None:
        """Send the graph of connections to a client, and from now on its changes."""
        self._worker.submit(partial(self._watch, member))

    def unwatch(self, member: CatalogMember) -> None:
        """Stop sending changes of the graph to a client."""
        self._worker.submit(partial(self._watchers.discard, member))

    def know(self, kind: type[Any]) -> None:
        """Add a type that a client has defined."""
        self._worker.submit(partial(self._types.add, kind))

    def topic(self, number: int) -> AdvertisedChannel:
        """Return the channel with a number.

        Raises:
            NotFoundError: No channel has the number.
        """
        return _at(self._topics, number, "channel")

    def service(self, number: int) -> AdvertisedChannel:
        """Return the service with a number.

        Raises:
            NotFoundError: No service has the number.
        """
        return _at(self._services, number, "service")

    def close(self) -> None:
        """Stop following the network."""
        self._types.close()
        self._worker.close()
        self._unfollow()

    # The following methods run on the thread of the worker, unless they say otherwise.

    def _join(self, member: CatalogMember) -> None:
        self._members.add(member)
        for listing in self._listings:
            member.send(listing.announce(listing.channels.values()))
        if self._followed is None:
            self._followed = self._node.context.graph.follow_all()
            self._listening = Registration(self._followed.listen(self._changed))
            self._update()

    def _leave(self, member: CatalogMember) -> None:
        self._members.discard(member)
        self._watchers.discard(member)
        if not self._members:
            self._unfollow()

    def _unfollow(self) -> None:
        if self._listening is not None and self._followed is not None:
            self._listening.close()
            self._followed.close()
            self._followed = self._listening = None
        self._types.retain(set())
        for listing in self._listings:
            listing.retain({})

    def _watch(self, member: CatalogMember) -> None:
        if member in self._members and member not in self._watchers and self._followed is not None:
            if not self._watchers:
                self._connections.read(self._followed.view())
            self._watchers.add(member)
            member.send(self._connections.describe())

    def _changed(self, _token: Token, _alive: bool) -> None:
        """Schedule an update. This runs on the thread of the graph."""
        with self._lock:
            if self._pending:
                return
            self._pending = True
        self._worker.later(_GATHER_SECONDS, self._update)

    def _update(self) -> None:
        with self._lock:
            self._pending = False
        if self._followed is None:
            return
        view = self._followed.view()
        alive = {(token.type_name, token.type_hash) for token in view.tokens}
        self._types.retain(alive)
        if self._watchers and (changes := self._connections.read(view)) is not None:
            _send(self._watchers, changes)
        self._compare(self._topics, self._wanted_topics(view))
        if self._services in self._listings:
            self._compare(self._services, self._wanted_services(view))

    def _compare(self, listing: _Listing, wanted: Mapping[_Key, Token]) -> None:
        if gone := listing.retain(wanted):
            if listing is self._topics:
                for member in self._members:
                    member.drop_channels(gone)
            _send(self._members, listing.withdraw(gone))
        missing = {key: token for key, token in wanted.items() if key not in listing.channels}
        channels = [
            listing.add(key, kind)
            for key, token in missing.items()
            if (kind := self._types.find(token)) is not None
        ]
        if channels:
            _send(self._members, listing.announce(channels))

    def _report(self, text: str) -> None:
        """Warn that a node does not describe a type."""
        self._node.log.warning("%s", text)
        _send(self._members, {"op": "status", "level": 1, "message": text})

    def _wanted_topics(self, view: View) -> dict[_Key, Token]:
        """Return, by topic and type, a publisher or else a subscription of another node."""
        first: dict[tuple[str, str], Token] = {}
        tokens = view.entities(Kind.PUBLISHER) + view.entities(Kind.SUBSCRIPTION)
        for token in tokens:
            own = token.kind is Kind.SUBSCRIPTION and token.node_name == self._node.name
            if not own and self._is_shown("subscribe", token.name):
                first.setdefault((token.name, token.type_name), token)
        return {(*key, token.type_hash): token for key, token in first.items()}

    def _wanted_services(self, view: View) -> dict[_Key, Token]:
        first: dict[str, Token] = {}
        for token in view.entities(Kind.SERVICE):
            if self._is_shown("call", token.name):
                first.setdefault(token.name, token)
        return {(name, t.type_name, t.type_hash): t for name, t in first.items()}

    def _is_shown(self, verb: Verb, name: str) -> bool:
        return (self._hidden or "/_" not in name) and not self._policy.objection(verb, name)

    def _is_in_graph(self, objects: str, name: str) -> bool:
        return self._policy.shows(objects, name) and (self._hidden or "/_" not in name)


class RequestedTypes(msgspec.Struct, eq=False):
    """Finds the classes of types, and requests unknown ones; used on one thread.

    Args:
        submit: Function that runs a task on that thread.
        arrived: Function called when a requested class is available.
        failed: Function called with the reason when a node does not describe a type.
    """

    _node: Node
    _submit: Callable[[Callable[[], object]], object]
    _arrived: Callable[[], object]
    _failed: Callable[[str], object]
    _worker: Worker[Callable[[], object]] = msgspec.field(
        default_factory=partial(Worker, "rosz-foxglove-types", threads=_REQUESTS)
    )
    _classes: dict[tuple[str, str], type[Any] | None] = msgspec.field(default_factory=dict)

    def add(self, cls: type[Any]) -> None:
        """Add a type that a client has defined."""
        self._classes[cls._type_name, cls._type_hash] = cls

    def find(self, token: Token) -> type[Any] | None:
        """Return the class of an entity's type, or None until its definition has arrived."""
        types, name = self._node.context.types, token.type_name
        cls: type[Any] | None = None
        with suppress(RoszError):
            cls = types.service(name) if token.kind is Kind.SERVICE else types.message(name)
        if cls is not None and token.type_hash in {NO_HASH, cls._type_hash}:
            return cls
        key = name, token.type_hash
        if key not in self._classes:
            self._classes[key] = None
            self._worker.submit(partial(self._request, key, token))
        return self._classes[key]

    def retain(self, alive: set[tuple[str, str]]) -> None:
        """Forget unanswered requests for types that no entity has, so that they can be repeated.

        Args:
            alive: Names and hashes of the types of all entities.
        """
        self._classes = {
            key: cls for key, cls in self._classes.items() if cls is not None or key in alive
        }

    def _request(self, key: tuple[str, str], token: Token) -> None:
        """Request a definition. This runs on a thread for requests."""
        try:
            cls = request_type(self._node, token)
        except RoszError as error:
            text = f"'{token.name}' is not shown, because its type is not known: {error}"
            self._submit(partial(self._failed, text))
        else:
            self._submit(partial(self._accept, key, cls))

    def _accept(self, key: tuple[str, str], cls: type[Any]) -> None:
        self._classes[key] = cls
        self._arrived()

    def close(self) -> None:
        """Stop requesting definitions."""
        self._worker.close()


class ConnectionGraph:
    """The graph of connections, as it was last sent to clients.

    Args:
        shows: Function that returns whether clients may see a name of a topic or service.
    """

    def __init__(self, shows: Callable[[str, str], bool]) -> None:
        self._shows = shows
        self._graph: _Graph = {}

    def read(self, view: View) -> dict[str, Any] | None:
        """Update the graph; return the message with the changes, or None without changes."""
        graph: _Graph = {}
        for kind, objects in _OBJECTS.items():
            nodes: defaultdict[str, set[str]] = defaultdict(set)
            for token in view.entities(kind):
                if self._shows(objects, token.name):
                    nodes[token.name].add(token.node_name)
            graph[kind.name] = {name: sorted(nodes[name]) for name in sorted(nodes)}
        before, self._graph = self._graph, graph
        return None if before == graph else _difference(before, graph)

    def describe(self) -> dict[str, Any]:
        """Return the message with the whole graph."""
        return _difference({}, self._graph)


def _difference(before: _Graph, after: _Graph) -> dict[str, Any]:
    """Return the message with the changes from one graph to another."""

    def changed(kind: Kind, member: str) -> list[dict[str, Any]]:
        old, new = before.get(kind.name, {}), after[kind.name]
        gone: dict[str, list[str]] = {name: [] for name in old if name not in new}
        return [
            {"name": name, member: nodes}
            for name, nodes in {**new, **gone}.items()
            if old.get(name) != nodes
        ]

    def names(graph: _Graph, *kinds: Kind) -> set[str]:
        return {name for kind in kinds for name in graph.get(kind.name, {})}

    both = Kind.PUBLISHER, Kind.SUBSCRIPTION
    return {
        "op": "connectionGraphUpdate",
        "publishedTopics": changed(Kind.PUBLISHER, "publisherIds"),
        "subscribedTopics": changed(Kind.SUBSCRIPTION, "subscriberIds"),
        "advertisedServices": changed(Kind.SERVICE, "providerIds"),
        "removedTopics": sorted(names(before, *both) - names(after, *both)),
        "removedServices": sorted(names(before, Kind.SERVICE) - names(after, Kind.SERVICE)),
    }


def _at(listing: _Listing, number: int, what: str) -> AdvertisedChannel:
    channel = listing.by_number.get(number)
    if channel is None:
        raise NotFoundError(f"there is no {what} {number}")
    return channel


def _send(members: Iterable[CatalogMember], value: Mapping[str, Any]) -> None:
    for member in members:
        member.send(value)


def _describe(cls: type[Any]) -> dict[str, Any]:
    return {
        "encoding": "cdr",
        "schemaName": cls._type_name,
        "schemaEncoding": "ros2msg",
        "schema": cls._full_text,
    }
