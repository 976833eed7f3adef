"""Detecting nodes of ROS 2, and when a node needs the services that each of them has.

A node declares them (`rosz.node.ros2.parameters`), and publishes the events of its parameters
(`rosz.node.ros2.events`), when something appears that may want them: a node that is not rosz, a
client of one of these services, or a subscription of these events. Until then they cost nothing,
and no list of services or topics shows them.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING

from msgspec.structs import replace

from rosz.errors import ClosedError
from rosz.lifecycle import Registration
from rosz.node.core import NodeCore
from rosz.params import Path, joined, split
from rosz.wire import (
    FOREIGN_DIGITS,
    NO_HASH,
    Kind,
    Token,
    clients_below_key,
    entities_key,
    nodes_key,
)
from rosz.worker import start_thread

if TYPE_CHECKING:
    from rosz.node.ros2.remote import RemoteParameters

_TOKENS_TIMEOUT = 1.0
_EVENTS = "/parameter_events"
_PACKAGES = ("rcl_interfaces/srv/", "type_description_interfaces/srv/")


class Ros2PeerDetector:
    """Follow such nodes and clients until there is a reason to declare the services of a node.

    Args:
        node: The node.
    """

    def __init__(self, node: NodeCore) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._declaring = False
        self._closed = False
        graph = node.context.graph
        self._followed = graph.follow(
            *_foreign_keys(graph.domain),
            clients_below_key(graph.domain, node.name),
            entities_key(graph.domain, Kind.SUBSCRIPTION, _EVENTS),
        )
        with self._lock:  # tokens that exist call `_declare` before this returns
            self._registration = Registration(self._followed.listen(self._changed))

    def close(self) -> None:
        """Stop following them; a second call has no effect."""
        self._closed = True
        self._registration.close()
        self._followed.close()

    def _changed(self, token: Token, alive: bool) -> None:
        """Declare the services if a token tells that they are needed; on the graph's thread."""
        if not alive or self._declaring:
            return
        own = token.name.rpartition("/")[0] == self._node.name
        if (
            token.kind is Kind.NODE
            or (own and token.type_name.startswith(_PACKAGES))
            or (token.kind is Kind.SUBSCRIPTION and token.name == _EVENTS)
        ):
            self._declaring = True
            name = f"rosz-ros2{self._node.name}"
            # Who was there before the node has to be told of the parameters that it starts with.
            declare = partial(self._declare, announce=not self._followed.complete)
            start_thread(threading.Thread(target=declare, name=name, daemon=True))

    def _declare(self, *, announce: bool) -> None:
        from rosz.node.ros2.events import ParameterEvents
        from rosz.node.ros2.parameters import Ros2ParameterServices

        with self._lock:
            if self._closed:
                return
            self.close()
            try:
                self._node.keep(Ros2ParameterServices(self._node))
                self._node.keep(ParameterEvents(self._node, announce=announce))
            except ClosedError:
                return  # the node ends


class Ros2Nodes:
    """The nodes of ROS 2 on the network, each of which keeps its parameters itself.

    Args:
        node: The node.
    """

    def __init__(self, node: NodeCore) -> None:
        self._node = node
        self._base = split(node.name)
        graph = node.context.graph
        self._followed = node.keep(graph.follow(*_foreign_keys(graph.domain)))
        self._remote: dict[Token, RemoteParameters] = {}

    def listen(self, changed: Callable[[], None]) -> None:
        """Call a function whenever such a node appears or disappears."""

        def forget(token: Token, _alive: bool) -> None:
            self._remote.pop(token, None)
            changed()

        self._followed.listen(forget)

    def owner(self, path: Path) -> RemoteParameters | None:
        """Return the parameters of the node whose name is at or above a path."""
        if not path or path[: len(self._base)] == self._base:
            return None
        # A name of one part is rarely that of a node, and most nodes read some as they start.
        is_known = len(path) == 1 or self._followed.complete
        view = self._followed.view() if is_known else self._followed.refresh(_TOKENS_TIMEOUT)
        names = {token.node_name: token for token in view.tokens}
        parts = (joined(path[:end]) for end in range(len(path), 0, -1)) if names else ()
        token = next((names[name] for name in parts if name in names), None)
        if token is None:
            return None
        if token not in self._remote:
            from rosz.node.ros2.remote import RemoteParameters

            context = self._node.context
            is_humble = context.environment.distro == "humble"
            server = replace(token, type_hash=NO_HASH if is_humble else "")
            self._remote[token] = RemoteParameters(context.session, server)
        return self._remote.get(token)


def _foreign_keys(domain: int) -> Iterator[str]:
    """Yield the key expressions of the tokens of nodes that are not rosz."""
    return (nodes_key(domain, f"$*{digit}$*") for digit in FOREIGN_DIGITS)
