"""The Master API and the Parameter Server API of ROS 1 (ROS wiki), over the network of rosz.

The table of registrations contains the programs of ROS 1; the graph contains all other nodes of the
network. Programs of ROS 1 receive each other's URIs, and connect to each other directly. For all
other nodes, they receive URIs of the bridge.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from typing import Any

from rosz.bridges.ros1.arguments import ArgumentChecker, InvalidArgument, check_integers
from rosz.bridges.ros1.calls import RpcCall
from rosz.bridges.ros1.registrations import NODE_PATH, Registrations
from rosz.bridges.ros1.registry import ANY_TYPE, RegistryEntry, Role
from rosz.bridges.ros1.shared import BRIDGE, BridgeResources
from rosz.bridges.ros1.sockets import Stream
from rosz.errors import InvalidName, ParamError, ParamNotFound, RoszError, ServiceError
from rosz.names import ros1_type
from rosz.params import climb, resolve
from rosz.wire import Kind

Answer = tuple[int, str, Any]
"""The result of every method of ROS 1: code, text and value."""

Method = tuple[Callable[..., Answer], tuple[str, ...], Any]
"""A method, the kinds of its arguments, and the value that it returns with an error."""


class Master:
    """The methods of the master and the parameter server that ROS 1's programs call.

    Args:
        registrations: Registrations of ROS 1's nodes.
        node_api: Function that answers a call to a node of the network. Its arguments are the name
            of the node, the call and the stream.
    """

    def __init__(
        self,
        shared: BridgeResources,
        registrations: Registrations,
        node_api: Callable[[str, RpcCall, Stream], Any],
    ) -> None:
        self._shared = shared
        self._registrations = registrations
        self._registry = registrations.registry
        self._params = shared.context.params
        self._node_api = node_api
        self._arguments = ArgumentChecker()
        self._methods: dict[str, Method] = {
            "getPid": (lambda _caller, _stream: (1, "", os.getpid()), (), -1),
            "getUri": (self._get_uri, (), ""),
            "registerPublisher": (self._register_publisher, ("name", "type", "uri"), []),
            "unregisterPublisher": (partial(self._unregister, "publisher"), ("name", "uri"), 0),
            "registerSubscriber": (self._register_subscriber, ("name", "type", "uri"), []),
            "unregisterSubscriber": (partial(self._unregister, "subscriber"), ("name", "uri"), 0),
            "registerService": (self._register_service, ("name", "uri", "uri"), 0),
            "unregisterService": (partial(self._unregister, "service"), ("name", "uri"), 0),
            "lookupNode": (self._lookup_node, ("name",), ""),
            "lookupService": (self._lookup_service, ("name",), ""),
            "getPublishedTopics": (self._get_published_topics, ("namespace",), 0),
            "getTopicTypes": (self._get_topic_types, (), []),
            "getSystemState": (self._get_system_state, (), [[], [], []]),
            "setParam": (self._set_param, ("key", "value"), 0),
            "getParam": (self._get_param, ("key",), 0),
            "hasParam": (self._has_param, ("key",), False),
            "deleteParam": (self._delete_param, ("key",), 0),
            "searchParam": (self._search_param, ("key",), 0),
            "getParamNames": (lambda *_: (1, "Parameter names", self._params.names()), (), []),
            "subscribeParam": (self._subscribe_param, ("uri", "key"), 0),
            "unsubscribeParam": (self._unsubscribe_param, ("uri", "key"), 0),
        }

    def dispatch(self, call: RpcCall, stream: Stream) -> Any:
        """Return the result of a call.

        Raises:
            ServiceError: The method does not exist.
        """
        if call.path.startswith(f"{NODE_PATH}/"):
            return self._node_api(call.path.removeprefix(NODE_PATH).rstrip("/"), call, stream)
        if call.method == "system.multicall":
            return self._multicall(call, stream)
        entry = self._methods.get(call.method)
        if entry is None:  # roscpp omits the path when it calls a node
            return self._node_api("", call, stream)
        method, kinds, default = entry
        try:
            return method(*self._arguments.check(call.args, kinds, stream))
        except (InvalidArgument, InvalidName, ParamError) as error:
            return (-1, str(error), default)

    def _multicall(self, call: RpcCall, stream: Stream) -> list[Any]:
        if len(call.args) != 1 or not isinstance(call.args[0], list):
            raise ServiceError("system.multicall: expected one list of calls")
        results: list[Any] = []
        for part in call.args[0]:
            try:
                method, args = part["methodName"], tuple(part["params"])
                if not isinstance(method, str) or method == call.method:
                    raise ServiceError("system.multicall: expected the name of another method")
                results.append([self.dispatch(RpcCall(call.path, method, args), stream)])
            except (KeyError, TypeError):
                results.append({"faultCode": 1, "faultString": "expected methodName and params"})
            except RoszError as error:
                results.append({"faultCode": 1, "faultString": str(error)})
        return results

    # Registrations.

    def _unregister(self, role: Role, caller: str, _: Stream, name: str, uri: str) -> Answer:
        if self._registrations.unregister(role, name, caller, uri):
            return 1, f"Unregistered [{caller}] as provider of [{name}]", 1
        return 1, f"[{caller}] is not registered for [{name}]", 0

    def _register_publisher(
        self, caller: str, stream: Stream, topic: str, type_name: str, uri: str
    ) -> Answer:
        self._registrations.register(RegistryEntry("publisher", topic, caller, uri, type_name))
        uris = self._registrations.uris("subscriber", topic)
        if self._shared.entities(Kind.SUBSCRIPTION, name=topic):
            uris.append(self._registrations.uri(stream.local_host))
        return 1, f"Registered [{caller}] as publisher of [{topic}]", uris

    def _register_subscriber(
        self, caller: str, stream: Stream, topic: str, type_name: str, uri: str
    ) -> Answer:
        self._registrations.register(RegistryEntry("subscriber", topic, caller, uri, type_name))
        uris = self._registrations.topic_uris(topic, stream.local_host)
        return 1, f"Subscribed to [{topic}]", uris

    def _register_service(
        self, caller: str, _: Stream, service: str, service_uri: str, uri: str
    ) -> Answer:
        self._registrations.register(
            RegistryEntry("service", service, caller, uri, service_uri=service_uri)
        )
        return 1, f"Registered [{caller}] as provider of [{service}]", 1

    # The state.

    def _get_uri(self, _caller: str, stream: Stream) -> Answer:
        return 1, "", self._registrations.uri(stream.local_host)

    def _lookup_node(self, _caller: str, stream: Stream, node: str) -> Answer:
        uri = self._registry.uri(node)
        if node == self._shared.name:
            uri = self._registrations.uri(stream.local_host)
        if uri:
            return 1, "node api", uri
        if any(token.node_name == node for token in self._shared.entities()):
            return 1, "node api", self._registrations.node_uri(stream.local_host, node)
        return -1, f"unknown node [{node}]", ""

    def _lookup_service(self, _caller: str, stream: Stream, service: str) -> Answer:
        entries = self._registry.entries("service", service)
        if entries:
            uri = entries[0].service_uri
        elif self._shared.entities(Kind.SERVICE, name=service):
            uri = f"rosrpc://{stream.local_host}:{self._registrations.port}"
        else:
            return -1, "no provider", ""
        return 1, f"rosrpc URI: [{uri}]", uri

    def _get_published_topics(self, _caller: str, _: Stream, namespace: str) -> Answer:
        types = self._registry.types()
        topics = {name: types.get(name, ANY_TYPE) for name in self._registry.by_name("publisher")}
        for token in self._shared.entities(Kind.PUBLISHER):
            topics.setdefault(token.name, ros1_type(token.name, token.type_name))
        below = f"{namespace.rstrip('/')}/" if namespace else ""
        return 1, "current topics", [[n, t] for n, t in topics.items() if n.startswith(below)]

    def _get_topic_types(self, _caller: str, _: Stream) -> Answer:
        types = self._registry.types()
        for token in self._shared.entities(Kind.PUBLISHER, Kind.SUBSCRIPTION):
            types.setdefault(token.name, ros1_type(token.name, token.type_name))
        return 1, "current system state", [[name, kind] for name, kind in types.items()]

    def _get_system_state(self, caller: str, _: Stream) -> Answer:
        """Return the nodes by topic and service; bridges receive only nodes of ROS 1."""
        roles: tuple[tuple[Role, Kind], ...] = (
            ("publisher", Kind.PUBLISHER),
            ("subscriber", Kind.SUBSCRIPTION),
            ("service", Kind.SERVICE),
        )
        state = []
        for role, kind in roles:
            nodes_by_name = self._registry.by_name(role)
            for token in () if caller.startswith(BRIDGE) else self._shared.entities(kind):
                nodes = nodes_by_name.setdefault(token.name, [])
                if token.node_name not in nodes:
                    nodes.append(token.node_name)
            state.append([[name, nodes] for name, nodes in nodes_by_name.items()])
        return 1, "current system state", state

    # Parameters, in the replicated store.

    def _set_param(self, caller: str, _: Stream, key: str, value: Any) -> Answer:
        check_integers(value, key)
        name = resolve(key, caller)
        self._params.set(name, value, origin=caller)
        return 1, f"parameter {name} set", 0

    def _get_param(self, caller: str, _: Stream, key: str) -> Answer:
        name = resolve(key, caller)
        try:
            return 1, f"Parameter [{name}]", self._params.peek(name)
        except ParamNotFound:
            return -1, f"Parameter [{name}] is not set", 0

    def _has_param(self, caller: str, _: Stream, key: str) -> Answer:
        name = resolve(key, caller)
        return 1, name, self._params.has(name)

    def _delete_param(self, caller: str, _: Stream, key: str) -> Answer:
        name = resolve(key, caller)
        try:
            self._params.delete(name, origin=caller)
        except ParamNotFound:
            return -1, f"parameter [{name}] is not set", 0
        return 1, f"parameter {name} deleted", 0

    def _search_param(self, caller: str, _: Stream, key: str) -> Answer:
        name = climb(key, caller, self._params.has)
        if name is None:
            return -1, f"Cannot find parameter [{key}] in an upwards search", ""
        return 1, f"Found [{name}]", name

    def _subscribe_param(self, caller: str, _: Stream, uri: str, key: str) -> Answer:
        name = resolve(key, caller)
        self._registrations.register(RegistryEntry("param", name, caller, uri))
        try:
            value: Any = self._params.peek(name)
        except ParamNotFound:
            value = {}
        return 1, f"Subscribed to parameter [{name}]", value

    def _unsubscribe_param(self, caller: str, _: Stream, uri: str, key: str) -> Answer:
        self._registrations.unregister("param", resolve(key, caller), caller, uri)
        return 1, f"Unsubscribe to parameter [{key}]", 1
