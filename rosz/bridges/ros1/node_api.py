"""The Slave API of ROS 1 (ROS wiki), for the nodes of the network and for the bridge itself."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

from rosz.bridges.ros1.calls import Call
from rosz.bridges.ros1.mirror import Mirror
from rosz.bridges.ros1.shared import Shared
from rosz.bridges.ros1.sockets import Stream
from rosz.errors import RoszError, ServiceError
from rosz.introspect.nodes import kill
from rosz.names import ros1_type
from rosz.wire import Kind, Token

__all__ = ("NodeApi",)

Answer = tuple[int, str, Any]
_REASON = "requested by a program of ROS 1"


class NodeApi:
    """Answers what ROS 1's programs ask a node.

    Args:
        shared: What the bridge shares.
        port: Port of the bridge.
        param_update: Function called with a parameter that a master says has changed, and its
            value.

    Attributes:
        mirror: What knows the connections; None until there is one.
    """

    def __init__(
        self,
        shared: Shared,
        port: int,
        param_update: Callable[[str, Any], object] | None = None,
    ) -> None:
        self._on_param = param_update
        self._shared = shared
        self._port = port
        self.mirror: Mirror | None = None
        self._methods: dict[str, Callable[..., Answer]] = {
            "getBusInfo": self._get_bus_info,
            "getBusStats": self._get_bus_stats,
            "getMasterUri": self._get_master_uri,
            "getPid": self._get_pid,
            "getPublications": self._get_publications,
            "getSubscriptions": self._get_subscriptions,
            "paramUpdate": self._param_update,
            "publisherUpdate": self._accept,
            "requestTopic": self._request_topic,
            "shutdown": self._shut_down,
        }

    def answer(self, node: str, call: Call, stream: Stream) -> Any:
        """Return the result of a call.

        Args:
            node: Name of the node of the network; empty for the bridge.
            call: The call.
            stream: The connection that it came on.

        Raises:
            ServiceError: The method does not exist.
        """
        method = self._methods.get(call.method)
        if method is None:
            raise ServiceError(f'method "{call.method:.100}" is not supported')
        if not call.args or not isinstance(call.args[0], str):
            return -1, "missing required caller_id parameter", 0
        return method(node, stream, *call.args[1:])

    def _tokens(self, node: str, *kinds: Kind) -> list[Token]:
        return [t for t in self._shared.entities(*kinds) if t.node_name == node]

    def _get_pid(self, node: str, _: Stream, *_args: Any) -> Answer:
        processes = self._shared.context.graph.view().processes(node) if node else []
        if node and not processes and not self._tokens(node):
            return -1, f"node [{node}] has ended", 0
        return 1, "", processes[-1].pid if processes else os.getpid()

    def _get_master_uri(self, _node: str, stream: Stream, *_args: Any) -> Answer:
        return 1, "", f"http://{stream.local_host}:{self._port}/"

    def _get_publications(self, node: str, _: Stream, *_args: Any) -> Answer:
        return 1, "publications", self._topics(node, Kind.PUBLISHER)

    def _get_subscriptions(self, node: str, _: Stream, *_args: Any) -> Answer:
        return 1, "subscriptions", self._topics(node, Kind.SUBSCRIPTION)

    def _topics(self, node: str, kind: Kind) -> list[list[str]]:
        found = {t.name: ros1_type(t.name, t.type_name) for t in self._tokens(node, kind)}
        return [[name, kind] for name, kind in found.items()]

    def _get_bus_stats(self, node: str, _: Stream, *_args: Any) -> Answer:
        """Tell the traffic of connections to ROS 1; what is counted is that of a connection."""
        published: list[list[Any]] = []
        subscribed: list[list[Any]] = []
        for token in self._tokens(node, Kind.PUBLISHER, Kind.SUBSCRIPTION):
            outward = token.kind is Kind.PUBLISHER
            known = self.mirror.connections(token.name) if self.mirror is not None else []
            found = [one for one in known if one.publishes != outward]
            numbered = list(enumerate(found, 1))
            if outward:
                total = sum(one.bytes for one in found)
                rows = [[number, one.bytes, one.messages, True] for number, one in numbered]
                published.append([token.name, total, rows])
            else:
                rows = [[number, one.bytes, -1, True] for number, one in numbered]
                subscribed.append([token.name, rows])
        return 1, "bus stats", [published, subscribed, []]

    def _get_bus_info(self, node: str, _: Stream, *_args: Any) -> Answer:
        info: list[list[Any]] = []
        for token in self._tokens(node, Kind.PUBLISHER, Kind.SUBSCRIPTION):
            direction = "o" if token.kind is Kind.PUBLISHER else "i"
            for other in self._others(token):
                info.append([len(info) + 1, other, direction, "TCPROS", token.name, True])
        return 1, "bus info", info

    def _others(self, token: Token) -> list[str]:
        """Return the nodes on both sides that an entity is connected to."""
        outward = token.kind is Kind.PUBLISHER
        kind = Kind.SUBSCRIPTION if outward else Kind.PUBLISHER
        found = [
            other.node_name
            for other in self._shared.entities(kind, name=token.name)
            if other.type_name == token.type_name
        ]
        if self.mirror is not None:
            found += [
                connection.node
                for connection in self.mirror.connections(token.name)
                if connection.publishes != outward
            ]
        return found

    def _param_update(self, _node: str, _: Stream, *args: Any) -> Answer:
        if len(args) == 2 and isinstance(args[0], str) and self._on_param is not None:  # noqa: PLR2004  # name and value
            self._on_param(args[0], args[1])
        return 1, "", 0

    def _accept(self, _node: str, _: Stream, *_args: Any) -> Answer:
        return 1, "", 0

    def _request_topic(self, _node: str, stream: Stream, *_args: Any) -> Answer:
        # Who publishes is looked at when it connects: a program that is refused here does not try
        # again, even if it is told meanwhile that there is a publisher.
        return 1, "ready", ["TCPROS", stream.local_host, self._port]

    def _shut_down(self, node: str, _: Stream, *args: Any) -> Answer:
        tokens = self._tokens(node, Kind.NODE) or self._tokens(node)
        if not tokens:
            return -1, f"node [{node}] is not to be shut down by programs of ROS 1", 0
        reason = str(args[0])[:200] if args and args[0] else _REASON
        try:
            kill(self._shared.context.session, tokens[0], reason)
        except RoszError as error:
            return 0, str(error), 0
        return 1, "shutdown", 0
