"""The Slave API of ROS 1 (ROS wiki), served for nodes of the network and the bridge itself."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from typing import Any

from rosz.bridges.ros1.calls import RpcCall
from rosz.bridges.ros1.master import Answer
from rosz.bridges.ros1.mirror import Mirror
from rosz.bridges.ros1.shared import BridgeResources, TopicConnection
from rosz.bridges.ros1.sockets import Stream
from rosz.errors import RoszError, ServiceError
from rosz.introspect import kill
from rosz.names import ros1_type
from rosz.wire import Kind, Token

_REASON = "requested by a program of ROS 1"


class NodeApi:
    """Answers calls of ROS 1's programs to nodes of the network.

    Args:
        port: Port of the bridge.
        param_update: Function called with the name and the value of a parameter that has changed,
            according to a master.

    Attributes:
        mirror: The mirror, which knows the connections; set before the first call.
    """

    def __init__(
        self,
        shared: BridgeResources,
        port: int,
        param_update: Callable[[str, Any], object] | None = None,
    ) -> None:
        self._on_param = param_update
        self._shared = shared
        self._port = port
        self.mirror: Mirror
        self._methods: dict[str, Callable[..., Answer]] = {
            "getBusInfo": self._get_bus_info,
            "getBusStats": self._get_bus_stats,
            "getMasterUri": self._get_master_uri,
            "getPid": self._get_pid,
            "getPublications": partial(self._get_topics, "publications", Kind.PUBLISHER),
            "getSubscriptions": partial(self._get_topics, "subscriptions", Kind.SUBSCRIPTION),
            "paramUpdate": self._param_update,
            "publisherUpdate": lambda *_: (1, "", 0),
            "requestTopic": self._request_topic,
            "shutdown": self._shut_down,
        }

    def answer(self, node: str, call: RpcCall, stream: Stream) -> Any:
        """Return the result of a call to a node; the name is empty for the bridge itself.

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

    def _get_topics(self, text: str, kind: Kind, node: str, _: Stream, *_args: Any) -> Answer:
        types = {t.name: ros1_type(t.name, t.type_name) for t in self._tokens(node, kind)}
        return 1, text, [[name, type_name] for name, type_name in types.items()]

    def _get_bus_stats(self, node: str, _: Stream, *_args: Any) -> Answer:
        """Return the traffic of each connection to ROS 1."""
        published: list[list[Any]] = []
        subscribed: list[list[Any]] = []
        for token in self._tokens(node, Kind.PUBLISHER, Kind.SUBSCRIPTION):
            outward = token.kind is Kind.PUBLISHER
            connections = self._connections(token)
            rows = [
                [number, connection.bytes, connection.messages if outward else -1, True]
                for number, connection in enumerate(connections, 1)
            ]
            if outward:
                total = sum(connection.bytes for connection in connections)
                published.append([token.name, total, rows])
            else:
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
        """Return the nodes of ROS 1 and of the network to which an entity is connected."""
        outward = token.kind is Kind.PUBLISHER
        kind = Kind.SUBSCRIPTION if outward else Kind.PUBLISHER
        nodes = [
            other.node_name
            for other in self._shared.entities(kind, name=token.name)
            if other.type_name == token.type_name
        ]
        return nodes + [connection.node for connection in self._connections(token)]

    def _connections(self, token: Token) -> list[TopicConnection]:
        """Return the connections of an entity to nodes of ROS 1."""
        connections = self.mirror.connections(token.name)
        return [c for c in connections if c.publishes != (token.kind is Kind.PUBLISHER)]

    def _param_update(self, _node: str, _: Stream, *args: Any) -> Answer:
        if len(args) == 2 and isinstance(args[0], str) and self._on_param is not None:  # noqa: PLR2004  # name and value
            self._on_param(args[0], args[1])
        return 1, "", 0

    def _request_topic(self, _node: str, stream: Stream, *_args: Any) -> Answer:
        # Whether the node publishes the topic is checked when the program connects: a program that
        # is refused here does not try again, even after an update about publishers.
        return 1, "ready", ["TCPROS", stream.local_host, self._port]

    def _shut_down(self, node: str, _: Stream, *args: Any) -> Answer:
        tokens = self._tokens(node, Kind.NODE) or self._tokens(node)
        if not tokens:
            return -1, f"programs of ROS 1 cannot shut down node [{node}]", 0
        reason = str(args[0])[:200] if args and args[0] else _REASON
        try:
            kill(self._shared.context.session, tokens[0], reason)
        except RoszError as error:
            return 0, str(error), 0
        return 1, "shutdown", 0
