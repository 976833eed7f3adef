"""Detecting when a node needs the services that every node of ROS 2 has.

A node declares them (`rosz.node.ros2.parameters`), and publishes the events of its parameters
(`rosz.node.ros2.events`), when something appears that may want them: a node that is not rosz, a
client of one of these services, or a subscription of these events. Until then they cost nothing,
and no list of services or topics shows them.
"""

from __future__ import annotations

import threading
from functools import partial

from rosz.errors import ClosedError
from rosz.lifecycle import Registration
from rosz.node.core import NodeCore
from rosz.wire import (
    FOREIGN_DIGITS,
    Kind,
    Token,
    clients_below_key,
    entities_key,
    nodes_key,
)
from rosz.worker import start_thread

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
        foreign = (nodes_key(graph.domain, f"$*{digit}$*") for digit in FOREIGN_DIGITS)
        self._followed = graph.follow(
            *foreign,
            clients_below_key(graph.domain, node.name),
            entities_key(graph.domain, Kind.SUBSCRIPTION, _EVENTS),
        )
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
