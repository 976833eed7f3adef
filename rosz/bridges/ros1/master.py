"""The Master API and the Parameter Server API of ROS 1 (ROS wiki), over the network of rosz.

What ROS 1's programs register stands in a `Registry`; what else the network has is read from its
graph. Parameters are those of the replicated store. Programs of ROS 1 learn each other's URIs and
talk to each other directly; for everything else they get that of the bridge.
"""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any
from urllib.parse import urlsplit

from rosz import names
from rosz.bridges.ros1.calls import Call
from rosz.bridges.ros1.notifier import Notifier
from rosz.bridges.ros1.registry import ANY_TYPE, Change, Entry, Registry, Role
from rosz.bridges.ros1.shared import BRIDGE, MASTER, Shared
from rosz.bridges.ros1.sockets import Stream
from rosz.errors import InvalidName, ParamError, ParamNotFound, RoszError, ServiceError
from rosz.params import climb, resolve, split
from rosz.params.replica import Changed, Watch
from rosz.wire import Kind, Token

__all__ = ("NODE_PATH", "Master")

NODE_PATH = "/node"
"""Path of the URI of a node of the network, before its name."""

Answer = tuple[int, str, Any]
"""Code, text and value: what every method of ROS 1 returns."""

_INTEGERS = range(-(1 << 31), 1 << 31)
_NEW_NODE = "new node registered with same name"
_KNOWN_SECONDS = 30.0
_MAX_HOSTS = 1000


class _Invalid(Exception):
    """An argument that a method refuses; the text is for the caller."""


class Master:
    """The methods that ROS 1's programs call of their master.

    Args:
        shared: What the bridge shares.
        port: Port of the bridge.
        changed: Function called with changes of the registrations, in their order.
        node_api: Function that answers a call of a node of the network: its name, the call and
            the stream.
    """

    def __init__(
        self,
        shared: Shared,
        port: int,
        changed: Callable[[list[Change]], object],
        node_api: Callable[[str, Call, Stream], Any],
    ) -> None:
        self._shared = shared
        self._port = port
        self._changed = changed
        self._node_api = node_api
        self._params = shared.context.params
        self._lock = threading.RLock()
        self._registry = Registry()
        self._watches: dict[Entry, Watch] = {}
        self._hosts: dict[tuple[str, str], tuple[float, str]] = {}
        self.notifier: Notifier = Notifier(shared, self.is_known)
        self._methods: dict[str, tuple[Callable[..., Answer], tuple[str, ...], Any]] = {
            "getPid": (self._get_pid, (), -1),
            "getUri": (self._get_uri, (), ""),
            "registerPublisher": (self._register_publisher, ("name", "type", "uri"), []),
            "unregisterPublisher": (self._unregister_publisher, ("name", "uri"), 0),
            "registerSubscriber": (self._register_subscriber, ("name", "type", "uri"), []),
            "unregisterSubscriber": (self._unregister_subscriber, ("name", "uri"), 0),
            "registerService": (self._register_service, ("name", "uri", "uri"), 0),
            "unregisterService": (self._unregister_service, ("name", "uri"), 0),
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
            "getParamNames": (self._get_param_names, (), []),
            "subscribeParam": (self._subscribe_param, ("uri", "key"), 0),
            "unsubscribeParam": (self._unsubscribe_param, ("uri", "key"), 0),
        }

    # What the bridge calls.

    def dispatch(self, call: Call, stream: Stream) -> Any:
        """Return the result of a call.

        Raises:
            ServiceError: The method does not exist.
        """
        if call.path.startswith(f"{NODE_PATH}/"):
            return self._node_api(call.path.removeprefix(NODE_PATH).rstrip("/"), call, stream)
        if call.method == "system.multicall":
            return self._multicall(call, stream)
        known = self._methods.get(call.method)
        if known is None:  # roscpp leaves the path out when it calls a node
            return self._node_api("", call, stream)
        method, kinds, default = known
        try:
            return method(*self._check_all(call.args, kinds, stream))
        except (_Invalid, InvalidName, ParamError) as error:
            return (-1, str(error), default)

    def topic_uris(self, topic: str, host: str) -> list[str]:
        """Return the URIs of the publishers of a topic for a subscriber of ROS 1.

        Args:
            topic: Name of the topic.
            host: Address of this machine, as the subscriber sees it.
        """
        with self._lock:
            uris = [entry.uri for entry in self._registry.entries("publisher", topic)]
        if self._shared.publishers(topic):
            uris.append(self._node_uri(host, self._shared.standing_for(Kind.PUBLISHER, topic)))
        return uris

    def notify(self, topic: str) -> None:
        """Tell the subscribers of a topic who publishes it now."""
        with self._lock:
            uris = [entry.uri for entry in self._registry.entries("subscriber", topic)]
        for uri in uris:
            self.notifier.post(
                uri,
                "publisherUpdate",
                topic,
                lambda host: (MASTER, topic, self.topic_uris(topic, host)),
            )

    def uri(self, host: str) -> str:
        """Return the URI of the bridge for those who reach it at an address."""
        return f"http://{host}:{self._port}/"

    def _node_uri(self, host: str, node: str) -> str:
        return f"{self.uri(host)[:-1]}{NODE_PATH}{node}/"

    def is_known(self, uri: str) -> bool:
        """Return whether a URI is that of a registered node."""
        with self._lock:
            return uri in self._registry.nodes().values()

    def nodes(self) -> dict[str, str]:
        """Return the URIs of all registered nodes by name."""
        with self._lock:
            return self._registry.nodes()

    def entries(self) -> list[Entry]:
        """Return all registrations."""
        with self._lock:
            return self._registry.dump()

    def restore(self, entries: Iterable[Entry]) -> None:
        """Add registrations of nodes that are known to be alive, unless they have come already.

        Subscribers are told who publishes, as rospy does not try to connect to the bridge again by
        itself. They are told when all is added: roscpp leaves publishers that are not in the list.
        """
        with self._lock:
            restored = [e for e in entries if self._registry.uri(e.node) in {"", e.uri}]
            for entry in restored:
                self._register(entry)
            for topic in {entry.name for entry in restored if entry.role == "subscriber"}:
                self.notify(topic)

    def drop(self, node: str, uri: str) -> bool:
        """Remove a node that has ended; return whether it was registered."""
        with self._lock:
            if self._registry.uri(node) != uri:
                return False
            self._apply(self._registry.remove_node(node))
            return True

    def terminate(self, node: str, reason: str) -> None:
        """Ask a node to end."""
        uri = self.nodes().get(node)
        if uri:
            self._shut_down(node, uri, reason)

    # Registrations.

    def _register(self, entry: Entry) -> None:
        with self._lock:
            result = self._registry.register(entry)
            self._apply(result.changes)
        if result.replaced:
            self._shut_down(entry.node, result.replaced, _NEW_NODE)

    def _shut_down(self, node: str, uri: str, reason: str) -> None:
        text = f"[{node}] Reason: {reason}"
        self.notifier.post(uri, "shutdown", "", lambda _host: (MASTER, text))

    def _unregister(self, role: Role, name: str, caller: str, uri: str) -> Answer:
        with self._lock:
            changes = self._registry.unregister(role, name, caller, uri)
            self._apply(changes)
        if changes:
            return 1, f"Unregistered [{caller}] as provider of [{name}]", 1
        return 1, f"[{caller}] is not registered for [{name}]", 0

    def _apply(self, changes: list[Change]) -> None:
        """Act on changes; needs the lock, so that they are reported in their order."""
        for entry, alive in ((change.entry, change.alive) for change in changes):
            if entry.role == "param":
                if alive:
                    self._watches[entry] = self._params.watch(
                        split(entry.name), partial(self._update, entry)
                    )
                else:
                    self._watches.pop(entry).close()
        if changes:
            self._changed(changes)
        for topic in {c.entry.name for c in changes if c.entry.role == "publisher"}:
            self.notify(topic)

    def _register_publisher(
        self, caller: str, stream: Stream, topic: str, type_name: str, uri: str
    ) -> Answer:
        self._register(Entry("publisher", topic, caller, uri, type_name))
        with self._lock:
            uris = [entry.uri for entry in self._registry.entries("subscriber", topic)]
        if self._shared.subscriptions(topic):
            uris.append(self.uri(stream.local_host))
        return 1, f"Registered [{caller}] as publisher of [{topic}]", uris

    def _unregister_publisher(self, caller: str, _: Stream, topic: str, uri: str) -> Answer:
        return self._unregister("publisher", topic, caller, uri)

    def _register_subscriber(
        self, caller: str, stream: Stream, topic: str, type_name: str, uri: str
    ) -> Answer:
        self._register(Entry("subscriber", topic, caller, uri, type_name))
        return 1, f"Subscribed to [{topic}]", self.topic_uris(topic, stream.local_host)

    def _unregister_subscriber(self, caller: str, _: Stream, topic: str, uri: str) -> Answer:
        return self._unregister("subscriber", topic, caller, uri)

    def _register_service(
        self, caller: str, _: Stream, service: str, service_uri: str, uri: str
    ) -> Answer:
        self._register(Entry("service", service, caller, uri, service_uri=service_uri))
        return 1, f"Registered [{caller}] as provider of [{service}]", 1

    def _unregister_service(self, caller: str, _: Stream, service: str, uri: str) -> Answer:
        return self._unregister("service", service, caller, uri)

    # What there is.

    def _get_pid(self, _caller: str, _: Stream) -> Answer:
        return 1, "", os.getpid()

    def _get_uri(self, _caller: str, stream: Stream) -> Answer:
        return 1, "", self.uri(stream.local_host)

    def _lookup_node(self, _caller: str, stream: Stream, node: str) -> Answer:
        with self._lock:
            uri = self._registry.uri(node)
        if node == self._shared.name:
            uri = self.uri(stream.local_host)
        if uri:
            return 1, "node api", uri
        if any(token.node_name == node for token in self._tokens()):
            return 1, "node api", self._node_uri(stream.local_host, node)
        return -1, f"unknown node [{node}]", ""

    def _lookup_service(self, _caller: str, stream: Stream, service: str) -> Answer:
        with self._lock:
            entries = self._registry.entries("service", service)
        if entries:
            uri = entries[0].service_uri
        elif self._shared.servers(service):
            uri = f"rosrpc://{stream.local_host}:{self._port}"
        else:
            return -1, "no provider", ""
        return 1, f"rosrpc URI: [{uri}]", uri

    def _get_published_topics(self, _caller: str, _: Stream, namespace: str) -> Answer:
        with self._lock:
            types = self._registry.types()
            found = {
                name: types.get(name, ANY_TYPE) for name in self._registry.by_name("publisher")
            }
        for token in self._tokens(Kind.PUBLISHER):
            found.setdefault(token.name, self._type(token))
        below = f"{namespace.rstrip('/')}/" if namespace else ""
        return 1, "current topics", [[n, t] for n, t in found.items() if n.startswith(below)]

    def _get_topic_types(self, _caller: str, _: Stream) -> Answer:
        with self._lock:
            found = self._registry.types()
        for token in self._tokens(Kind.PUBLISHER, Kind.SUBSCRIPTION):
            found.setdefault(token.name, self._type(token))
        return 1, "current system state", [[name, kind] for name, kind in found.items()]

    def _get_system_state(self, caller: str, _: Stream) -> Answer:
        """Tell who does what; of the network nothing to bridges, which join ROS 1's programs."""
        roles: tuple[tuple[Role, Kind], ...] = (
            ("publisher", Kind.PUBLISHER),
            ("subscriber", Kind.SUBSCRIPTION),
            ("service", Kind.SERVICE),
        )
        state = []
        for role, kind in roles:
            with self._lock:
                found = self._registry.by_name(role)
            for token in () if caller.startswith(BRIDGE) else self._tokens(kind):
                nodes = found.setdefault(token.name, [])
                if token.node_name not in nodes:
                    nodes.append(token.node_name)
            state.append([[name, nodes] for name, nodes in found.items()])
        return 1, "current system state", state

    def _tokens(self, *kinds: Kind) -> list[Token]:
        return self._shared.entities(*kinds)

    def _type(self, token: Token) -> str:
        return names.ros1_type(token.name, token.type_name)

    # Parameters.

    def _set_param(self, caller: str, _: Stream, key: str, value: Any) -> Answer:
        _check_integers(value, key)
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
        found = climb(key, caller, self._params.has)
        if found is None:
            return -1, f"Cannot find parameter [{key}] in an upwards search", ""
        return 1, f"Found [{found}]", found

    def _get_param_names(self, _caller: str, _: Stream) -> Answer:
        return 1, "Parameter names", self._params.names()

    def _subscribe_param(self, caller: str, _: Stream, uri: str, key: str) -> Answer:
        name = resolve(key, caller)
        self._register(Entry("param", name, caller, uri))
        try:
            value: Any = self._params.peek(name)
        except ParamNotFound:
            value = {}
        return 1, f"Subscribed to parameter [{name}]", value

    def _unsubscribe_param(self, caller: str, _: Stream, uri: str, key: str) -> Answer:
        self._unregister("param", resolve(key, caller), caller, uri)
        return 1, f"Unsubscribe to parameter [{key}]", 1

    def _update(self, entry: Entry, changed: Changed) -> None:
        value = {} if changed.new is None else changed.new
        name = f"{changed.name.rstrip('/')}/"
        self.notifier.post(entry.uri, "paramUpdate", name, lambda _host: (MASTER, name, value))

    # Arguments.

    def _multicall(self, call: Call, stream: Stream) -> list[Any]:
        if len(call.args) != 1 or not isinstance(call.args[0], list):
            raise ServiceError("system.multicall: expected one list of calls")
        results: list[Any] = []
        for one in call.args[0]:
            try:
                method, args = one["methodName"], tuple(one["params"])
                if not isinstance(method, str) or method == call.method:
                    raise ServiceError(
                        "system.multicall: a call has no method of its own"
                    )  # becomes a fault
                part = Call(call.path, method, args)
                results.append([self.dispatch(part, stream)])
            except (KeyError, TypeError):
                results.append({"faultCode": 1, "faultString": "expected methodName and params"})
            except RoszError as error:
                results.append({"faultCode": 1, "faultString": str(error)})
        return results

    def _check_all(
        self, given: tuple[Any, ...], kinds: tuple[str, ...], stream: Stream
    ) -> list[Any]:
        """Return the arguments of a method.

        Raises:
            _Invalid: They are not of their kinds.
        """
        if not given:
            raise _Invalid("missing required caller_id parameter")
        caller, *others = given
        if len(others) != len(kinds):
            raise _Invalid("Error: bad call arity")
        if not isinstance(caller, str):
            raise _Invalid("caller_id must be a string")
        checked = [
            self._check(kind, value, caller, stream)
            for kind, value in zip(kinds, others, strict=True)
        ]
        return [caller, stream, *checked]

    def _check(self, kind: str, value: Any, caller: str, stream: Stream) -> Any:
        """Return an argument in the form that methods use.

        Raises:
            _Invalid: It is not of its kind.
        """
        if kind == "value":
            return value
        if not isinstance(value, str) or not (value or kind == "namespace"):
            raise _Invalid(f"ERROR: parameter [{kind}] must be a non-empty string")
        match kind:
            case "uri":
                return self._reachable(value, stream)
            case "type":
                if value != ANY_TYPE and value.count("/") != 1:
                    raise _Invalid("ERROR: parameter [type] is not a valid package resource name")
            case "name":
                if ":" in value or " " in value:
                    raise _Invalid("ERROR: parameter [name] contains illegal chars")
                if value == "/":
                    raise _Invalid("ERROR: parameter [name] cannot be the global namespace")
                return names.resolve(value, caller)
            case "namespace":
                return names.resolve(value, caller) if value else ""
        return value

    def _reachable(self, uri: str, stream: Stream) -> str:
        """Return a URI that can be reached from here.

        A host name that is not known here, or means this machine although the program runs on
        another one, is replaced by the address that the program has connected from.

        Raises:
            _Invalid: It is not a URI.
        """
        try:
            parts = urlsplit(uri)
            host, port = parts.hostname, parts.port
        except ValueError as error:
            raise _Invalid(f"ERROR: '{uri:.200}' is not an RPC URI: {error}") from error
        if parts.scheme not in {"http", "rosrpc"} or not host or not port:
            raise _Invalid(f"ERROR: parameter [{uri:.200}] is not an RPC URI")
        if len(self._hosts) > _MAX_HOSTS:
            self._hosts.clear()
        now = time.monotonic()
        until, known = self._hosts.get((host, stream.host), (0.0, ""))
        if until < now:
            known = _reachable_host(host, stream.host)
            self._hosts[host, stream.host] = now + _KNOWN_SECONDS, known
        return uri if known == host else f"{parts.scheme}://{known}:{port}{parts.path}"


def _reachable_host(host: str, seen: str) -> str:
    """Return a host name, or the address that its program was seen at if that is better."""
    try:
        found = {str(info[4][0]) for info in socket.getaddrinfo(host, None, socket.AF_INET)}
    except (OSError, UnicodeError):
        return seen
    here = all(address.startswith("127.") for address in found)
    return seen if here and not seen.startswith("127.") else host


def _check_integers(value: Any, key: str) -> None:
    """Refuse what ROS 1's programs could not read.

    Raises:
        _Invalid: There is an integer beyond 32 bits.
    """
    match value:
        case bool():
            return
        case int() if value not in _INTEGERS:
            raise _Invalid(f"parameter [{key}]: {value} exceeds the 32 bits of XML-RPC's integers")
        case list():
            for each in value:
                _check_integers(each, key)
        case dict():
            for each in value.values():
                _check_integers(each, key)
