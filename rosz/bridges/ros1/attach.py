"""A bridge to a running roscore, which rosz joins as a node.

The state of the master is read once a second, and its nodes appear on the network. The bridge
registers topics and services of the network at the master, under its own name. If several bridges
connect one master and one network, only the oldest works; the next one takes over when it ends.
"""

from __future__ import annotations

import re
import socket
from collections.abc import Callable
from functools import partial
from typing import Any

import msgspec

from rosz.access import NamePattern, matches_any
from rosz.bridges.ros1.joined_params import RUN_ID, JoinedParameters
from rosz.bridges.ros1.mirror import Mirror
from rosz.bridges.ros1.node_api import NodeApi
from rosz.bridges.ros1.peers import Address, call, multicall
from rosz.bridges.ros1.registry import Change, RegistryEntry, Role
from rosz.bridges.ros1.server import Ros1Server
from rosz.bridges.ros1.shared import BRIDGE, MASTER_NODE, BridgeResources
from rosz.bridges.ros1.sockets import log
from rosz.environment import Environment
from rosz.errors import DecodeError, RoszError, ServiceError, TransportError
from rosz.lifecycle import Closing, Registration
from rosz.names import ros1_type
from rosz.node import BridgedNode, Context
from rosz.wire import Kind, own_key
from rosz.worker import Worker

_POLL_SECONDS = 1.0
_LOOK_SECONDS = 0.05
_TOKENS_TIMEOUT = 1.0
_UNKNOWN = object()
_Names = list[tuple[str, list[str]]]
_State = tuple[dict[str, list[str]], ...]
"""The nodes of each published topic, of each subscribed topic, and of each service."""


class CrossingNames(msgspec.Struct, frozen=True):
    """The names that cross, as patterns with ``*``; an empty tuple means all names.

    Attributes:
        topics: Patterns of topics.
        services: Patterns of services.
        params: Patterns of parameters.
    """

    topics: tuple[NamePattern, ...] = ()
    services: tuple[NamePattern, ...] = ()
    params: tuple[NamePattern, ...] = ()


class AttachedBridge(Closing):
    """A node at a master of ROS 1 that connects both networks.

    Args:
        master: URI of the master.
        environment: Settings; those of the process when not given.
        names: Names of ROS 1 that cross.
        namespace: Namespace on the network for all names of ROS 1, such as ``/robot1``.

    Raises:
        DecodeError: The URI of the master is not valid.
        TransportError: The host of the master is not known, or the session cannot be opened.
        UsageError: A variable of the environment has an invalid value.
    """

    def __init__(
        self,
        master: str,
        environment: Environment | None = None,
        *,
        names: CrossingNames = CrossingNames(),  # noqa: B008  # frozen
        namespace: str = "",
    ) -> None:
        self._master = master
        self._names = names
        self._address = Address.parse(master)
        host = _own_address(self._address)
        context = Context(environment or Environment.read())
        self._shared = shared = BridgeResources(context, namespace.rstrip("/"))
        self._lifecycle = shared.lifecycle
        self._lifecycle.keep(context)
        self._lifecycle.keep(Registration(shared.close))
        self._worker: Worker[Callable[[], object]] = Worker("rosz-ros1-master", logger=log)
        self._params = JoinedParameters(shared, self._worker, self._call, names.params)
        self._entries: set[RegistryEntry] = set()
        self._uris: dict[str, str] = {}
        self._ended: set[tuple[str, str]] = set()
        self._run_id: object = _UNKNOWN
        self._reported = ""
        self._looking = False
        try:
            self._open(host)
        except BaseException:
            self.close()
            raise

    def _open(self, host: str) -> None:
        shared = self._shared
        context = shared.context
        server = self._lifecycle.keep(Ros1Server(shared.loop, host, 0))
        self._uri = f"http://{host}:{server.port}/"
        machine = re.sub(r"\W", "_", socket.gethostname(), flags=re.ASCII)
        shared.name = f"{BRIDGE}{machine}_{server.port}"
        own = self._lifecycle.keep(BridgedNode(context, shared.name, lambda _reason: None))
        api = NodeApi(shared, server.port, self._params.update)
        self._mirror = api.mirror = Mirror(
            shared, own, _keep, lambda _topic: self._look(), self._look
        )
        self._lifecycle.keep(self._mirror)
        self._lifecycle.keep(Registration(self._worker.close))
        self._lifecycle.keep(Registration(self._leave))
        self._rank = f"{context.session.stamp().time:020}-{context.session.zid}"
        self._lifecycle.keep(context.session.token(self._mark(self._rank)))
        self._lifecycle.keep(context.params.watch((), self._params.changed))
        server.start(lambda call, stream: api.answer("", call, stream), self._mirror.accept)
        shared.prober.start(
            lambda: self._uris,
            lambda *probed: self._worker.submit(partial(self._on_probe, *probed)),
        )
        self._worker.submit(self._poll)

    def close(self) -> None:
        """Leave the master; a second call has no effect."""
        self._lifecycle.close()

    # Reading the state of the master, on the thread of the worker.

    def _look(self) -> None:
        """Read the state of the master soon, before the next poll."""
        if not self._looking:
            self._looking = True
            self._worker.later(_LOOK_SECONDS, self._look_once)

    def _poll(self) -> None:
        """Read the state of the master, and schedule the next poll."""
        try:
            self._look_once()
        finally:
            self._worker.later(_POLL_SECONDS, self._poll)

    def _look_once(self) -> None:
        self._looking = False
        if self._lifecycle.closing:
            return
        try:
            self._follow()
        except RoszError as error:
            self._run_id = _UNKNOWN
            if not self._reported:
                self._reported = str(error)
                log.warning("waiting for the master at %s: %s", self._master, error)
        else:
            if self._reported:
                self._reported = ""
                log.warning("joined the master at %s again", self._master)

    def _follow(self) -> None:
        name = self._shared.name
        state, types, run_id = multicall(
            self._master,
            [("getSystemState", (name,)), ("getTopicTypes", (name,)), ("getParam", (name, RUN_ID))],
        )
        nodes = _read_state(state)
        types_by_topic = dict(_convert(types, list[tuple[str, str]]))
        self._check_master()
        self._params.active = self._is_first()
        if not self._params.active:
            self._uris = {}
            self._apply(set())
            return
        self._apply(self._read(nodes, types_by_topic))
        self._register(self._without_ended(nodes))
        if run_id != self._run_id:
            self._params.join(self._uri)
            self._run_id = run_id

    def _check_master(self) -> None:
        """Refuse a master that belongs to this network."""
        nodes = self._shared.context.graph.view().nodes()
        masters = [node for node in nodes if node.startswith(MASTER_NODE)]
        calls = [("lookupNode", (self._shared.name, node)) for node in masters]
        if any(multicall(self._master, calls)):
            raise ServiceError(
                "it belongs to this network already (`rosz core --ros1`); to join it from another"
                " network, set ROS_DOMAIN_ID or ROSZ_RENDEZVOUS"
            )

    def _is_first(self) -> bool:
        """Return whether this is the oldest of the bridges to this master."""
        session = self._shared.context.session
        keys = session.live_tokens(self._mark("*"), _TOKENS_TIMEOUT)
        oldest = min((key.rpartition("/")[2] for key in keys), default=self._rank)
        return oldest >= self._rank

    def _mark(self, rank: str) -> str:
        """Return the key of the token of a bridge to this master; ``*`` matches every rank."""
        place = re.sub(r"[^A-Za-z0-9._-]", "_", f"{self._address.host}_{self._address.port}")
        space = self._shared.namespace.replace("/", "%") or "%"
        return own_key(self._shared.context.domain, "ros1", place, space, rank)

    def _read(self, state: _State, types: dict[str, str]) -> set[RegistryEntry]:
        """Return the registrations that cross."""
        crossing = self._crossing(state)
        nodes = {node for part in state for listed in part.values() for node in listed}
        bridges = {node for node in nodes if node.startswith(BRIDGE)}
        services = sorted({name for role, name, _ in crossing if role == "service"})
        of_node, of_service = self._look_up(
            sorted({node for _, _, node in crossing} | bridges), services
        )
        before = self._uris.items()
        self._uris = {node: self._reachable(uri) for node, uri in of_node.items() if uri}
        self._ended &= self._uris.items()
        for node, uri in self._uris.items() - before:
            self._shared.prober.check(node, uri)
        return {
            RegistryEntry(
                role,
                name,
                node,
                self._uris[node],
                types.get(name, "*") if role != "service" else "",
                self._reachable(of_service[name]) if role == "service" else "",
            )
            for role, name, node in crossing
            if node in self._uris and (role != "service" or of_service[name])
            if (node, self._uris[node]) not in self._ended
        }

    def _crossing(self, state: _State) -> list[tuple[Role, str, str]]:
        """Return role, name and node of each registration that crosses, except those of bridges."""
        roles: tuple[tuple[Role, tuple[NamePattern, ...]], ...] = (
            ("publisher", self._names.topics),
            ("subscriber", self._names.topics),
            ("service", self._names.services),
        )
        return [
            (role, name, node)
            for (role, patterns), nodes_by_name in zip(roles, state, strict=False)
            for name, nodes in nodes_by_name.items()
            if matches_any(patterns, name)
            for node in nodes
            if not node.startswith(BRIDGE)
        ]

    def _look_up(
        self, nodes: list[str], services: list[str]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the URIs of nodes and of services."""
        own = self._shared.name
        uris = multicall(
            self._master,
            [("lookupNode", (own, node)) for node in nodes]
            + [("lookupService", (own, name)) for name in services],
        )
        of_node = dict(zip(nodes, uris, strict=False))
        return of_node, dict(zip(services, uris[len(nodes) :], strict=False))

    def _reachable(self, uri: str) -> str:
        """Return a URI; the host becomes that of the master if it cannot be resolved here."""
        address = Address.parse(uri)
        try:
            socket.getaddrinfo(address.host, None, socket.AF_INET)
        except (OSError, UnicodeError):
            return uri.replace(f"//{address.host}:", f"//{self._address.host}:")
        return uri

    def _on_probe(self, node: str, uri: str, is_there: bool) -> None:
        """Remove an ended node from the network, because the master keeps its registrations."""
        if is_there == ((node, uri) in self._ended):
            (self._ended.discard if is_there else self._ended.add)((node, uri))
            self._look()

    def _apply(self, entries: set[RegistryEntry]) -> None:
        gone, new = self._entries - entries, entries - self._entries
        self._entries = entries
        changes = [Change(entry, alive=False) for entry in gone]
        changes += [Change(entry, alive=True) for entry in new]
        if changes:
            self._mirror.apply(changes)

    # Registering topics and services of the network at the master.

    def _register(self, state: _State) -> None:
        """Register topics and services of the network, and unregister those that have ended."""
        own, uri = self._shared.name, self._uri
        topics = self._offered(Kind.PUBLISHER, self._names.topics)
        published, _, served = state
        for topic, type_name in topics.items():
            if own not in published.get(topic, ()):
                self._call("registerPublisher", topic, ros1_type(topic, type_name), uri)
        for topic, nodes in published.items():
            if own in nodes and topic not in topics:
                self._call("unregisterPublisher", topic, uri)
        services = self._offered(Kind.SERVICE, self._names.services)
        for service in services:
            if service not in served:
                self._call("registerService", service, _service_uri(self._uri), uri)
        for service, nodes in served.items():
            if own in nodes and service not in services:
                self._call("unregisterService", service, _service_uri(self._uri))

    def _offered(self, kind: Kind, patterns: tuple[NamePattern, ...]) -> dict[str, str]:
        """Return the types of the entities to register, by their names in ROS 1."""
        shared = self._shared
        types = {}
        for token in shared.entities(kind):
            name = shared.there(token.name)
            if token.node_name.startswith(BRIDGE):
                continue
            if name is not None and matches_any(patterns, name):
                types[name] = token.type_name
        return types

    def _call(self, method: str, *args: Any) -> Any:
        return call(self._master, method, (self._shared.name, *args))

    def _leave(self) -> None:
        """Unregister everything that the bridge has registered."""
        try:
            state = _read_state(self._call("getSystemState"))
            self._unregister_all(self._shared.name, self._uri, state)
        except RoszError as error:
            log.debug("the master has gone: %s", error)

    def _without_ended(self, state: _State) -> _State:
        """Unregister killed bridges of this machine; return a state without them."""
        host = Address.parse(self._uri).host
        ended = {
            node: uri
            for node, uri in self._ended
            if node.startswith(BRIDGE) and Address.parse(uri).host == host
        }
        for node, uri in ended.items():
            self._unregister_all(node, uri, state)
        return tuple(
            {
                name: alive
                for name, nodes in nodes_by_name.items()
                if (alive := [*set(nodes) - ended.keys()])
            }
            for nodes_by_name in state
        )

    def _unregister_all(self, node: str, uri: str, state: _State) -> None:
        """Unregister everything that a bridge has registered."""
        published, _, served = state
        for topic in (name for name, nodes in published.items() if node in nodes):
            call(self._master, "unregisterPublisher", (node, topic, uri))
        for service in (name for name, nodes in served.items() if node in nodes):
            call(self._master, "unregisterService", (node, service, _service_uri(uri)))
        call(self._master, "unsubscribeParam", (node, uri, "/"))


def _read_state(state: Any) -> _State:
    """Return the result of ``getSystemState`` as dictionaries."""
    return tuple(map(dict, _convert(state, tuple[_Names, _Names, _Names])))


def _convert(value: Any, kind: Any) -> Any:
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise DecodeError("state of the master", -1, str(error)) from error


def _service_uri(uri: str) -> str:
    """Return the URI for all services of a bridge; they share the port of its XML-RPC server."""
    return uri.replace("http:", "rosrpc:").rstrip("/")


def _keep(node: str, reason: str) -> None:
    log.warning("node '%s' of ROS 1 keeps running although it was asked to end: %s", node, reason)


def _own_address(address: Address) -> str:
    """Return the address of this machine on the network interface towards another one."""
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect((address.host, address.port))
            own_address: str = probe.getsockname()[0]
            return own_address
    except (OSError, UnicodeError) as error:
        raise TransportError(f"cannot reach {address}: {error}") from error
