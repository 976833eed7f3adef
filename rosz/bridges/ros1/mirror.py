"""The registrations of ROS 1's nodes as entities on the network, and connections to the bridge.

All of it runs on one thread, that for changes.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any

from rosz.bridges.ros1.actions import ActionGateways
from rosz.bridges.ros1.frames import encode_header
from rosz.bridges.ros1.published import PublishedTopic
from rosz.bridges.ros1.registry import ANY_TYPE, Change, RegistryEntry, Role
from rosz.bridges.ros1.server import Incoming
from rosz.bridges.ros1.services import Clients, ProvidedService, ServiceConnection
from rosz.bridges.ros1.shared import BRIDGE, MASTER_NODE, BridgeResources, TopicConnection
from rosz.bridges.ros1.sockets import log
from rosz.bridges.ros1.subscribed import SubscribedTopic
from rosz.errors import ClosedError, InvalidName, RoszError, ServiceError, UsageError
from rosz.lifecycle import Registration
from rosz.node import BridgedNode
from rosz.wire import Kind, Token
from rosz.worker import Worker

_CALLS = 64
_MAX_CALLS = 1000
_CLOSE_TIMEOUT = 10.0
_RETRY_SECONDS = 0.3
_MOST_TRIES = 10


_MirroredPart = PublishedTopic | SubscribedTopic | ProvidedService
"""A registration on the network."""

_PARTS: dict[Role, Callable[[BridgeResources, BridgedNode, RegistryEntry], _MirroredPart]] = {
    "publisher": PublishedTopic,
    "subscriber": SubscribedTopic,
    "service": ProvidedService,
}


class Mirror:
    """Shows ROS 1's nodes to the network.

    Args:
        terminate: Function that asks a node of ROS 1 to end: its name and the reason.
        published: Function called with a topic whose publishers on the network have changed.
        look: Function called when a subscriber connects that is not known yet, but may be soon.
    """

    def __init__(
        self,
        shared: BridgeResources,
        own: BridgedNode,
        terminate: Callable[[str, str], object],
        published: Callable[[str], object],
        look: Callable[[], object] | None = None,
    ) -> None:
        self._shared = shared
        self._look = look
        self._terminate = terminate
        self._published = published
        self._own = own
        self._clients = Clients(own, shared)
        self._actions = ActionGateways(shared)
        self._calls: Worker[Callable[[], object]] = Worker(
            "rosz-ros1-services", threads=_CALLS, capacity=_MAX_CALLS, logger=log
        )
        self._parts: dict[tuple[Role, str, str], _MirroredPart] = {}
        self._by_name: dict[str, list[_MirroredPart]] = {}
        self._nodes: dict[str, BridgedNode] = {}
        self._lock = threading.Lock()
        self._changed: dict[str, bool] = {}
        # It ends before the workers that it uses.
        shared.lifecycle.keep(Registration(shared.context.graph.listen(self._on_token)))

    def apply(self, changes: list[Change]) -> None:
        """Show changes of registrations, soon and in their order; any thread may call it."""
        self._shared.changes.submit(partial(self._apply, changes))

    def accept(self, incoming: Incoming, header: dict[str, str]) -> None:
        """Take a connection of a program of ROS 1; any thread may call it."""
        self._shared.changes.submit(partial(self._accept, incoming, header))

    def connections(self, topic: str) -> list[TopicConnection]:
        """Return the connections to nodes of ROS 1 for a topic of the network."""
        return [
            connection
            for part in list(self._by_name.get(topic, ()))
            if isinstance(part, PublishedTopic | SubscribedTopic)
            for connection in part.connections()
        ]

    def close(self) -> None:
        """Take everything from the network."""
        self._calls.close(0)
        self._actions.close()
        self._shared.changes.submit(self._close)
        self._shared.changes.flush(_CLOSE_TIMEOUT)

    def _close(self) -> None:
        for part in list(self._parts.values()):
            part.close()
        for node in list(self._nodes.values()):
            node.close()

    def _apply(self, changes: list[Change]) -> None:
        for change in changes:
            try:
                if change.alive:
                    self._add(change.entry)
                else:
                    self._remove(change.entry)
                self._actions.change(change.entry, alive=change.alive)
            except ClosedError:
                return
            except (InvalidName, UsageError) as error:
                log.warning(
                    "%s '%s' of node '%s' stays in ROS 1: %s",
                    change.entry.role,
                    change.entry.name,
                    change.entry.node,
                    error,
                )

    def _add(self, entry: RegistryEntry) -> None:
        make = _PARTS.get(entry.role)
        if make is None:
            return
        node = self._nodes.get(entry.node)
        if node is None:
            identity = self._shared.identity(entry.node, Kind.NODE)
            node = BridgedNode(
                self._shared.context,
                self._shared.here(entry.node),
                partial(self._terminate, entry.node),
                identity.number,
                identity.started,
            )
            identity.started = node.process.started
            self._nodes[entry.node] = node
        self._keep(make(self._shared, node, entry))

    def _keep(self, part: _MirroredPart) -> _MirroredPart:
        entry = part.entry
        self._parts[entry.role, entry.name, entry.node] = part
        self._by_name.setdefault(self._shared.here(entry.name), []).append(part)
        return part

    def _remove(self, entry: RegistryEntry) -> None:
        part = self._parts.pop((entry.role, entry.name, entry.node), None)
        if part is not None:
            name = self._shared.here(entry.name)
            others = self._by_name[name]
            others.remove(part)
            if not others:
                del self._by_name[name]
            part.close()
        if not any(node == entry.node for _, _, node in self._parts):
            node = self._nodes.pop(entry.node, None)
            if node is not None:
                node.close()

    # The network.

    def _on_token(self, token: Token, _alive: bool) -> None:
        """Note that something has changed about a name; runs on the thread of the graph."""
        if not token.name or token.zid == self._shared.context.session.zid:
            return
        with self._lock:
            first = not self._changed
            self._changed[token.name] = token.kind is Kind.PUBLISHER or self._changed.get(
                token.name, False
            )
        if first:
            self._shared.changes.submit(self._update)

    def _update(self) -> None:
        """Adapt to changes of the network."""
        with self._lock:
            changed, self._changed = self._changed, {}
        for name, is_published in changed.items():
            for part in list(self._by_name.get(name, ())):
                part.update()
            self._clients.update(name)
            self._actions.update(name)
            if is_published:
                # Not only for the first and the last: a subscriber may have registered in between.
                self._published(name)

    # Connections.

    def _accept(
        self,
        incoming: Incoming,
        header: dict[str, str],
        tries: int = 0,
        waited: frozenset[PublishedTopic] = frozenset(),
    ) -> None:
        try:
            if "service" in header:
                self._accept_service(incoming, header)
            elif "topic" in header:
                self._accept_topic(incoming, header, tries, waited)
            else:
                raise ServiceError("a header without 'topic' or 'service'")
        except RoszError as error:
            incoming.stream.send([encode_header({"error": str(error)})])
            incoming.refuse(str(error))

    def _accept_topic(
        self,
        incoming: Incoming,
        header: dict[str, str],
        tries: int,
        waited: frozenset[PublishedTopic],
    ) -> None:
        topic, node = header["topic"], header.get("callerid", "")
        part: Any = self._parts.get(("subscriber", topic, node))
        if part is None and node.startswith(MASTER_NODE):
            # A master of another network, for the nodes of which it registers nothing.
            entry = RegistryEntry("subscriber", topic, node, "", ANY_TYPE)
            part = self._keep(SubscribedTopic(self._shared, self._own, entry))
        connecting = self._find_connecting(node, waited)
        if connecting is not None:
            again = partial(self._accept, incoming, header, tries, waited | {connecting})
            connecting.when_connected(again)
            return
        if part is None and self._look is not None and tries < _MOST_TRIES:
            self._look()
            again = partial(self._accept, incoming, header, tries + 1)
            self._shared.changes.later(_RETRY_SECONDS, again)
            return
        if part is None:
            raise ServiceError(f"node '{node}' is not registered as a subscriber of '{topic}'")
        part.accept(incoming, header)

    def _find_connecting(
        self, node: str, waited: frozenset[PublishedTopic]
    ) -> PublishedTopic | None:
        """Return a topic that a node publishes, to which the bridge still connects.

        The answers of a node to its first message, such as those of an action server, would be
        lost before that: roscpp keeps nothing for subscribers that are not connected. Bridges do
        not wait for bridges, as both would wait.
        """
        if node.startswith((MASTER_NODE, BRIDGE)):
            return None
        published = [
            part
            for part in self._parts.values()
            if isinstance(part, PublishedTopic) and part.entry.node == node and part not in waited
        ]
        for part in published:
            part.update()  # the network may have subscribed since
        return next((part for part in published if part.is_connecting), None)

    def _accept_service(self, incoming: Incoming, header: dict[str, str]) -> None:
        client = self._clients.find(self._shared.here(header["service"]))
        wanted, there = header.get("md5sum", "*"), client.service_type._md5sum
        if wanted not in {"*", there}:
            raise ServiceError(
                f"service '{client.name}' is {client.service_type._type} (md5 {there});"
                f" expected md5 {wanted}"
            )
        connection = ServiceConnection(
            self._shared,
            incoming,
            client,
            persistent=header.get("persistent") == "1",
            submit=self._calls.offer,
        )
        connection.open(probe=header.get("probe") == "1")
