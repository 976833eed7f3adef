"""The topics, services and connections of the network, as clients are told of them.

The network is followed while there are clients. One thread compares what there is with what clients
know, and sends them the difference. So each of them hears of changes in their order. Definitions
of types that are not known here are requested on other threads.
"""

from __future__ import annotations

import itertools
import threading
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import msgspec

from rosz.bridges.gate import Gate, Verb
from rosz.errors import NotFoundError, RoszError
from rosz.graph import Followed, View
from rosz.lifecycle import Closable, Registration
from rosz.node.type_description import request_type
from rosz.wire import NO_HASH, Kind, Token
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.node import Node

__all__ = ("Catalog", "Channel", "Member")

_GATHER_SECONDS = 0.05
"""Time in which changes are gathered, as nodes come with many entities at once."""

_REQUESTS = 4

_Key = tuple[str, str, str]
_Graph = dict[str, dict[str, list[str]]]


class Member(Protocol):
    """A client, as the catalog sees it."""

    def send(self, value: Mapping[str, Any]) -> None:
        """Send a message."""

    def drop_channels(self, channels: Iterable[int]) -> None:
        """End the subscriptions of channels that exist no longer."""


class Channel(msgspec.Struct, frozen=True):
    """A topic of one type, or a service.

    Attributes:
        id: Number for clients; another definition gets another one.
        name: Full name of the topic or service.
        kind: Class of the messages, or of the service.
    """

    id: int
    name: str
    kind: type[Any]

    def describe_topic(self) -> dict[str, Any]:
        """Return the channel as clients are told of it."""
        return {"id": self.id, "topic": self.name, **_describe(self.kind)}

    def describe_service(self) -> dict[str, Any]:
        """Return the service as clients are told of it."""
        return {
            "id": self.id,
            "name": self.name,
            "type": self.kind._type_name,
            "request": _describe(self.kind.Request),
            "response": _describe(self.kind.Response),
        }


class _Listing:
    """The topics, or the services, that clients know of.

    Attributes:
        known: What clients know, by name, type and hash.
        by_number: The same by the number that clients use.
    """

    def __init__(self, op: str, member: str, describe: Callable[[Channel], dict[str, Any]]) -> None:
        self._op = op
        self._member = member
        self._describe = describe
        self._numbers = itertools.count(1)
        self.known: dict[_Key, Channel] = {}
        self.by_number: dict[int, Channel] = {}

    def add(self, key: _Key, kind: type[Any]) -> Channel:
        """Give a number to something new."""
        channel = self.known[key] = Channel(next(self._numbers), key[0], kind)
        self.by_number[channel.id] = channel
        return channel

    def retain(self, wanted: Mapping[_Key, Token]) -> list[int]:
        """Forget what exists no longer; return its numbers."""
        gone = [self.known.pop(key) for key in list(self.known) if key not in wanted]
        return [self.by_number.pop(channel.id).id for channel in gone]

    def announce(self, channels: Iterable[Channel]) -> dict[str, Any]:
        """Return the message that tells clients of channels."""
        return {
            "op": f"advertise{self._op}",
            f"{self._member}s": [self._describe(channel) for channel in channels],
        }

    def withdraw(self, numbers: list[int]) -> dict[str, Any]:
        """Return the message that tells clients what exists no longer."""
        single = "channel" if not self._op else self._member
        return {"op": f"unadvertise{self._op}", f"{single}Ids": numbers}


class Catalog:
    """The topics, services and connections of a network, followed while there are members.

    Args:
        node: The node of the bridge.
        gate: Permissions of the clients.
        hidden: Whether to show topics and services with a part that begins with ``_``.
        services: Whether clients may call services.
    """

    def __init__(self, node: Node, gate: Gate, *, hidden: bool, services: bool) -> None:
        self._node = node
        self._gate = gate
        self._hidden = hidden
        self._lock = threading.Lock()
        self._worker = Worker[Callable[[], object]]("rosz-foxglove-catalog", logger=node.log)
        self._requests = Worker[Callable[[], object]]("rosz-foxglove-types", threads=_REQUESTS)
        self._requested: dict[tuple[str, str], type[Any] | None] = {}
        self._members: set[Member] = set()
        self._watchers: set[Member] = set()
        self._pending = False
        self._followed: Followed | None = None
        self._listening: Closable | None = None
        self._topics = _Listing("", "channel", Channel.describe_topic)
        self._services = _Listing("Services", "service", Channel.describe_service)
        self._listings = (self._topics, self._services) if services else (self._topics,)
        self._graph: _Graph = {}

    def join(self, member: Member) -> None:
        """Tell a client of all that there is, and of changes from now on."""
        self._worker.submit(partial(self._join, member))

    def leave(self, member: Member) -> None:
        """Tell a client no more; without clients, the network is not followed."""
        self._worker.submit(partial(self._leave, member))

    def watch(self, member: Member) -> None:
        """Send a client the graph of connections, and its changes from now on."""
        self._worker.submit(partial(self._watch, member))

    def unwatch(self, member: Member) -> None:
        """Send a client no more changes of the graph."""
        self._worker.submit(partial(self._watchers.discard, member))

    def know(self, kind: type[Any]) -> None:
        """Use the definition of a type that a client brings along."""
        key = kind._type_name, kind._type_hash
        self._worker.submit(partial(self._requested.__setitem__, key, kind))

    def topic(self, number: int) -> Channel:
        """Return the channel of a number.

        Raises:
            NotFoundError: There is none.
        """
        return _at(self._topics, number, "channel")

    def service(self, number: int) -> Channel:
        """Return the service of a number.

        Raises:
            NotFoundError: There is none.
        """
        return _at(self._services, number, "service")

    def close(self) -> None:
        """Stop following the network."""
        self._requests.close()
        self._worker.close()
        self._unfollow()

    # On the thread of the worker.

    def _join(self, member: Member) -> None:
        self._members.add(member)
        for listing in self._listings:
            member.send(listing.announce(listing.known.values()))
        if self._followed is None:
            self._followed = self._node.context.graph.follow_all()
            self._listening = Registration(self._followed.listen(self._changed))
            self._update()

    def _leave(self, member: Member) -> None:
        self._members.discard(member)
        self._watchers.discard(member)
        if not self._members:
            self._unfollow()

    def _unfollow(self) -> None:
        if self._listening is not None and self._followed is not None:
            self._listening.close()
            self._followed.close()
            self._followed = self._listening = None
        self._forget_requests(set())
        for listing in self._listings:
            listing.retain({})

    def _watch(self, member: Member) -> None:
        if member in self._members and member not in self._watchers and self._followed is not None:
            if not self._watchers:
                self._graph = self._connections(self._followed.view())
            self._watchers.add(member)
            member.send(_difference({}, self._graph))

    def _changed(self, _token: Token, _alive: bool) -> None:
        """Look at the network soon; on the thread of the graph."""
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
        self._forget_requests(alive)
        if self._watchers:
            before, self._graph = self._graph, self._connections(view)
            if before != self._graph:
                _send(self._watchers, _difference(before, self._graph))
        self._compare(self._topics, self._wanted_topics(view))
        if self._services in self._listings:
            self._compare(self._services, self._wanted_services(view))

    def _compare(self, listing: _Listing, wanted: Mapping[_Key, Token]) -> None:
        if gone := listing.retain(wanted):
            if listing is self._topics:
                for member in self._members:
                    member.drop_channels(gone)
            _send(self._members, listing.withdraw(gone))
        missing = {key: token for key, token in wanted.items() if key not in listing.known}
        found = [
            listing.add(key, kind)
            for key, token in missing.items()
            if (kind := self._kind(token)) is not None
        ]
        if found:
            _send(self._members, listing.announce(found))

    def _kind(self, token: Token) -> type[Any] | None:
        """Return the class of a type, or None while its definition is on its way."""
        types, name = self._node.context.types, token.type_name
        known: type[Any] | None = None
        with suppress(RoszError):
            known = types.service(name) if token.kind is Kind.SERVICE else types.message(name)
        if known is not None and token.type_hash in {NO_HASH, known._type_hash}:
            return known
        kind = name, token.type_hash
        if kind not in self._requested:
            self._requested[kind] = None
            self._requests.submit(partial(self._request, kind, token))
        return self._requested[kind]

    def _forget_requests(self, alive: set[tuple[str, str]]) -> None:
        """Let types be requested again that nobody described, and that nobody has any more."""
        self._requested = {
            kind: found
            for kind, found in self._requested.items()
            if found is not None or kind in alive
        }

    def _request(self, kind: tuple[str, str], token: Token) -> None:
        """Request a definition; on a thread for requests."""
        try:
            found = request_type(self._node, token)
        except RoszError as error:
            self._worker.submit(partial(self._refuse, token, error))
        else:
            self._worker.submit(partial(self._accept, kind, found))

    def _accept(self, kind: tuple[str, str], found: type[Any]) -> None:
        self._requested[kind] = found
        self._update()

    def _refuse(self, token: Token, error: RoszError) -> None:
        """Report a type that its node does not describe."""
        text = f"'{token.name}' is not shown, as its type is not known: {error}"
        self._node.log.warning("%s", text)
        _send(self._members, {"op": "status", "level": 1, "message": text})

    def _wanted_topics(self, view: View) -> dict[_Key, Token]:
        """Return a publisher of each topic and type, or else a subscription of another node."""
        found: dict[tuple[str, str], Token] = {}
        tokens = view.entities(Kind.PUBLISHER) + view.entities(Kind.SUBSCRIPTION)
        for token in tokens:
            own = token.kind is Kind.SUBSCRIPTION and token.node_name == self._node.name
            if not own and self._is_shown("topics", token.name):
                found.setdefault((token.name, token.type_name), token)
        return {(*key, token.type_hash): token for key, token in found.items()}

    def _wanted_services(self, view: View) -> dict[_Key, Token]:
        found: dict[str, Token] = {}
        for token in view.entities(Kind.SERVICE):
            if self._is_shown("services", token.name):
                found.setdefault(token.name, token)
        return {(name, one.type_name, one.type_hash): one for name, one in found.items()}

    def _is_shown(self, what: str, name: str) -> bool:
        verb: Verb = "subscribe" if what == "topics" else "call"
        return (self._hidden or "/_" not in name) and not self._gate.objection(verb, name)

    def _connections(self, view: View) -> _Graph:
        graph: _Graph = {}
        for kind, what in (
            (Kind.PUBLISHER, "topics"),
            (Kind.SUBSCRIPTION, "topics"),
            (Kind.SERVICE, "services"),
        ):
            found: defaultdict[str, set[str]] = defaultdict(set)
            for token in view.entities(kind):
                if self._gate.shows(what, token.name) and (self._hidden or "/_" not in token.name):
                    found[token.name].add(token.node_name)
            graph[kind.name] = {name: sorted(found[name]) for name in sorted(found)}
        return graph


def _at(listing: _Listing, number: int, what: str) -> Channel:
    channel = listing.by_number.get(number)
    if channel is None:
        raise NotFoundError(f"there is no {what} {number}")
    return channel


def _send(members: Iterable[Member], value: Mapping[str, Any]) -> None:
    for member in members:
        member.send(value)


def _describe(cls: type[Any]) -> dict[str, Any]:
    return {
        "encoding": "cdr",
        "schemaName": cls._type_name,
        "schemaEncoding": "ros2msg",
        "schema": cls._full_text,
    }


def _difference(before: _Graph, after: _Graph) -> dict[str, Any]:
    """Return the message that makes one graph of another."""

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
