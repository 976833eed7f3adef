"""The registrations of a master of ROS 1, and the calls that tell nodes of changes."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from rosz.bridges.ros1.peers import call
from rosz.bridges.ros1.registry import Change, Registry, RegistryEntry, Role
from rosz.bridges.ros1.shared import MASTER, BridgeResources
from rosz.bridges.ros1.sockets import log
from rosz.errors import RoszError, TransportError
from rosz.params import split
from rosz.params.replica import Changed, Watch
from rosz.wire import Kind

NODE_PATH = "/node"
"""Path of the URI of a node of the network, before its name."""

_RETRY = 1.0
_Args = Callable[[str], tuple[Any, ...]]
"""Function that makes the arguments of a call of the address of this machine."""

_NEW_NODE = "new node registered with same name"


class Registrations:
    """The table of registrations, and the reactions to its changes. Safe for threads.

    Args:
        port: Port of the bridge.
        changed: Function called with changes of the registrations, in their order.

    Attributes:
        registry: The table.
    """

    def __init__(
        self, shared: BridgeResources, port: int, changed: Callable[[list[Change]], object]
    ) -> None:
        self.registry = Registry()
        self._lock = self.registry.lock
        self._shared = shared
        self.port = port
        self._changed = changed
        self._watches: dict[RegistryEntry, Watch] = {}
        self._notifier = Notifier(shared, lambda uri: uri in self.registry.nodes().values())

    def topic_uris(self, topic: str, host: str) -> list[str]:
        """Return the URIs of the publishers of a topic for a subscriber of ROS 1.

        Args:
            topic: Name of the topic.
            host: Address of this machine, as the subscriber sees it.
        """
        uris = self.uris("publisher", topic)
        if self._shared.entities(Kind.PUBLISHER, name=topic):
            uris.append(self.node_uri(host, self._shared.standing_for(Kind.PUBLISHER, topic)))
        return uris

    def notify(self, topic: str) -> None:
        """Tell the subscribers of a topic who publishes it now."""
        for uri in self.uris("subscriber", topic):
            self._notifier.post(
                uri,
                "publisherUpdate",
                topic,
                lambda host: (MASTER, topic, self.topic_uris(topic, host)),
            )

    def uri(self, host: str) -> str:
        """Return the URI of the bridge for those who reach it at an address."""
        return f"http://{host}:{self.port}/"

    def node_uri(self, host: str, node: str) -> str:
        """Return the URI of a node of the network for those who reach the bridge at an address."""
        return f"{self.uri(host)[:-1]}{NODE_PATH}{node}/"

    def restore(self, entries: Iterable[RegistryEntry]) -> None:
        """Add registrations of nodes that are known to be alive, unless they have come already.

        Subscribers are told who publishes, as rospy does not try to connect to the bridge again by
        itself. They are told when all is added: roscpp leaves publishers that are not in the list.
        """
        with self._lock:
            restored = [e for e in entries if self.registry.uri(e.node) in {"", e.uri}]
            for entry in restored:
                self.register(entry)
            for topic in {entry.name for entry in restored if entry.role == "subscriber"}:
                self.notify(topic)

    def drop(self, node: str, uri: str) -> bool:
        """Remove a node that has ended; return whether it was registered."""
        with self._lock:
            if self.registry.uri(node) != uri:
                return False
            self._apply(self.registry.remove_node(node))
            return True

    def terminate(self, node: str, reason: str) -> None:
        """Ask a node to end."""
        if uri := self.registry.uri(node):
            self._shut_down(node, uri, reason)

    def register(self, entry: RegistryEntry) -> None:
        """Add a registration, and ask an older node of the same name to end."""
        with self._lock:
            older = self.registry.uri(entry.node)
            self._apply(self.registry.register(entry))
        if older not in {"", entry.uri}:
            self._shut_down(entry.node, older, _NEW_NODE)

    def _shut_down(self, node: str, uri: str, reason: str) -> None:
        text = f"[{node}] Reason: {reason}"
        self._notifier.post(uri, "shutdown", "", lambda _host: (MASTER, text))

    def unregister(self, role: Role, name: str, node: str, uri: str) -> bool:
        """Remove a registration; return whether there was one."""
        with self._lock:
            changes = self.registry.unregister(role, name, node, uri)
            self._apply(changes)
        return bool(changes)

    def uris(self, role: Role, topic: str) -> list[str]:
        """Return the URIs of the nodes that are registered for a topic."""
        return [entry.uri for entry in self.registry.entries(role, topic)]

    def _apply(self, changes: list[Change]) -> None:
        """Act on changes; needs the lock, so that they are reported in their order."""
        for entry, alive in ((change.entry, change.alive) for change in changes):
            if entry.role == "param":
                if alive:
                    self._watches[entry] = self._shared.context.params.watch(
                        split(entry.name), partial(self._update, entry)
                    )
                else:
                    self._watches.pop(entry).close()
        if changes:
            self._changed(changes)
        for topic in {c.entry.name for c in changes if c.entry.role == "publisher"}:
            self.notify(topic)

    def _update(self, entry: RegistryEntry, changed: Changed) -> None:
        value = {} if changed.new is None else changed.new
        name = f"{changed.name.rstrip('/')}/"
        self._notifier.post(entry.uri, "paramUpdate", name, lambda _host: (MASTER, name, value))


class Notifier:
    """Calls nodes, one call at a time for each. Safe for threads.

    A node that hangs holds up nobody else, and misses nothing: failed calls are made again.

    Args:
        is_known: Function that tells whether a URI is still that of a node.
    """

    def __init__(self, shared: BridgeResources, is_known: Callable[[str], bool]) -> None:
        self._shared = shared
        self._is_known = is_known
        self._lock = threading.Lock()
        self._pending: dict[str, dict[tuple[str, str], _Args]] = {}
        self._running: set[str] = set()

    def post(self, uri: str, method: str, subject: str, args: _Args) -> None:
        """Call a method of a node, soon.

        Args:
            uri: URI of the node.
            method: Name of the method.
            subject: Name of the subject of the call; a call that waits for the same method and
                subject is replaced.
            args: Function that makes the arguments, when the call is made.
        """
        with self._lock:
            self._pending.setdefault(uri, {})[method, subject] = args
            if uri in self._running:
                return
            self._running.add(uri)
        self._shared.requests.submit(partial(self._run, uri))

    def _run(self, uri: str) -> None:
        """Make the calls of a node that wait."""
        while True:
            with self._lock:
                pending = self._pending.get(uri)
                if not pending:
                    self._pending.pop(uri, None)
                    self._running.discard(uri)
                    return
                method, subject = next(iter(pending))
                args = pending.pop((method, subject))
            try:
                call(uri, method, args)
            except TransportError as error:
                with self._lock:
                    self._pending.setdefault(uri, {}).setdefault((method, subject), args)
                log.debug("%s", error)
                self._shared.changes.later(_RETRY, partial(self._resume, uri))
                return
            except RoszError as error:
                log.debug("node at %s: %s", uri, error)

    def _resume(self, uri: str) -> None:
        if self._is_known(uri):
            self._shared.requests.submit(partial(self._run, uri))
            return
        with self._lock:
            self._pending.pop(uri, None)
            self._running.discard(uri)
