"""A bridge to a roscore that runs already: rosz joins it as a node.

The state of the master is read once a second. Its nodes appear on the network; what the network
publishes and serves is registered there under the name of the bridge. Of several bridges to one
master on one network only the oldest works, and the next takes over when it ends.
"""

from __future__ import annotations

import re
import socket
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, Self

import msgspec

from rosz.bridges.gate import matches
from rosz.bridges.ros1.mirror import Mirror
from rosz.bridges.ros1.node_api import NodeApi
from rosz.bridges.ros1.peers import Address, call, multicall
from rosz.bridges.ros1.registry import Change, Entry, Role
from rosz.bridges.ros1.server import Server
from rosz.bridges.ros1.shared import BRIDGE, MASTER_NODE, Shared
from rosz.bridges.ros1.sockets import log
from rosz.environment import Environment
from rosz.errors import (
    DecodeError,
    EncodeError,
    ParamNotFound,
    RoszError,
    ServiceError,
    TransportError,
)
from rosz.lifecycle import Registration
from rosz.names import ros1_type
from rosz.node import BridgedNode, Context
from rosz.params import leaves, normalise, split
from rosz.params.replica import Changed
from rosz.wire import Kind, own_key
from rosz.worker import Worker

__all__ = ("AttachedBridge", "Choice")

_POLL_SECONDS = 1.0
_LOOK_SECONDS = 0.05
_TOKENS_TIMEOUT = 1.0
_RUN_ID = "/run_id"
_UNKNOWN = object()
_Names = list[tuple[str, list[str]]]
_State = tuple[dict[str, list[str]], ...]
"""The nodes of each topic that is published, of each that is subscribed to, of each service."""

_OWN_PARAMS = (_RUN_ID, "/rosdistro", "/rosversion", "/roslaunch")
"""Parameters that tell of one master, and belong to it alone."""


class Choice(msgspec.Struct, frozen=True):
    """Which names cross; each is a list of patterns with ``*``, and an empty one means all.

    Attributes:
        topics: Topics.
        services: Services.
        params: Parameters.
    """

    topics: tuple[str, ...] = ()
    services: tuple[str, ...] = ()
    params: tuple[str, ...] = ()


class AttachedBridge:
    """A node at a master of ROS 1, through which both networks are one.

    Args:
        master: URI of the master.
        environment: Settings; those of the process when not given.
        choice: Names of ROS 1 that cross.
        namespace: Namespace on the network for all names of ROS 1, such as ``/robot1``.

    Raises:
        DecodeError: The URI is not one.
        TransportError: The host of the master is not known, or the session cannot be opened.
        UsageError: A variable of the environment has an invalid value.
    """

    def __init__(
        self,
        master: str,
        environment: Environment | None = None,
        *,
        choice: Choice = Choice(),  # noqa: B008  # frozen
        namespace: str = "",
    ) -> None:
        self._master = master
        self._choice = choice
        self._address = Address.parse(master)
        host = _own_address(self._address)
        context = Context(environment or Environment.read())
        self._shared = shared = Shared(context, "", namespace.rstrip("/"))
        self._lifecycle = shared.lifecycle
        self._lifecycle.keep(context)
        self._lifecycle.keep(Registration(shared.close))
        self._worker: Worker[Callable[[], object]] = Worker("rosz-ros1-master", logger=log)
        self._entries: set[Entry] = set()
        self._uris: dict[str, str] = {}
        self._ended: set[tuple[str, str]] = set()
        self._run_id: object = _UNKNOWN
        self._reported = ""
        self._active = False
        self._looking = False
        try:
            self._open(host)
        except BaseException:
            self.close()
            raise

    def _open(self, host: str) -> None:
        shared = self._shared
        context = shared.context
        server = self._lifecycle.keep(Server(shared.loop, host, 0))
        self._uri = f"http://{host}:{server.port}/"
        self._service_uri = _service_uri(self._uri)
        machine = re.sub(r"\W", "_", socket.gethostname(), flags=re.ASCII)
        shared.name = f"{BRIDGE}{machine}_{server.port}"
        self._own = self._lifecycle.keep(BridgedNode(context, shared.name, lambda _reason: None))
        api = NodeApi(shared, server.port, self._param_update)
        self._mirror = api.mirror = Mirror(
            shared, self._own, _keep, lambda _topic: self._look(), self._look
        )
        self._lifecycle.keep(self._mirror)
        self._lifecycle.keep(Registration(self._worker.close))
        self._lifecycle.keep(Registration(self._leave))
        self._rank = f"{context.session.stamp().time:020}-{context.session.zid}"
        self._lifecycle.keep(context.session.token(self._mark(self._rank)))
        self._lifecycle.keep(context.params.watch((), self._changed))
        server.start(
            lambda call, stream: api.answer("", call, stream),
            self._mirror.accept,
        )
        shared.prober.start(
            lambda: self._uris,
            lambda *found: self._worker.submit(partial(self._on_probe, *found)),
        )
        self._worker.submit(self._poll)

    def close(self) -> None:
        """Leave the master; a second call has no effect."""
        self._lifecycle.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    # The master, on the thread of the worker.

    def _look(self) -> None:
        """Look at the master soon."""
        if not self._looking:
            self._looking = True
            self._worker.later(_LOOK_SECONDS, self._look_once)

    def _poll(self) -> None:
        """Look at the master once a second."""
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
            [
                ("getSystemState", (name,)),
                ("getTopicTypes", (name,)),
                ("getParam", (name, _RUN_ID)),
            ],
        )
        nodes = _read_state(state)
        kinds = dict(_convert(types, list[tuple[str, str]]))
        self._check_master()
        self._active = self._is_first()
        if not self._active:
            self._uris = {}
            self._apply(set())
            return
        self._apply(self._read(nodes, kinds))
        self._register(self._without_ended(nodes))
        if run_id != self._run_id:
            self._join_params()
            self._run_id = run_id

    def _check_master(self) -> None:
        """Refuse a master that is one of this network.

        Raises:
            ServiceError: It is one; what it knows is on the network already.
        """
        nodes = self._shared.context.graph.view().nodes()
        own = [node for node in nodes if node.startswith(MASTER_NODE)]
        calls = [("lookupNode", (self._shared.name, node)) for node in own]
        if any(multicall(self._master, calls)):
            raise ServiceError(
                "it belongs to this network already (`rosz core --ros1`), so there is nothing to"
                " join: ROS_DOMAIN_ID and ROSZ_RENDEZVOUS name another network"
            )

    def _is_first(self) -> bool:
        """Return whether this is the oldest of the bridges to this master."""
        session = self._shared.context.session
        keys = session.live_tokens(self._mark("*"), _TOKENS_TIMEOUT)
        oldest = min((key.rpartition("/")[2] for key in keys), default=self._rank)
        return oldest >= self._rank

    def _mark(self, rank: str) -> str:
        """Return the key of the token of a bridge to this master."""
        place = re.sub(r"[^A-Za-z0-9._-]", "_", f"{self._address.host}_{self._address.port}")
        space = self._shared.namespace.replace("/", "%") or "%"
        return own_key(self._shared.context.domain, "ros1", place, space, rank)

    def _read(self, state: _State, types: dict[str, str]) -> set[Entry]:
        """Return the registrations that cross."""
        roles: tuple[tuple[Role, tuple[str, ...]], ...] = (
            ("publisher", self._choice.topics),
            ("subscriber", self._choice.topics),
            ("service", self._choice.services),
        )
        found: list[tuple[Role, str, str]] = [
            (role, name, node)
            for (role, patterns), known in zip(roles, state, strict=False)
            for name, nodes in known.items()
            if matches(patterns, name)
            for node in nodes
            if not node.startswith(BRIDGE)
        ]
        bridges = {n for known in state for nodes in known.values() for n in nodes if _is_bridge(n)}
        nodes = sorted({node for _, _, node in found} | bridges)
        services = sorted({name for role, name, _ in found if role == "service"})
        own = self._shared.name
        uris = multicall(
            self._master,
            [("lookupNode", (own, node)) for node in nodes]
            + [("lookupService", (own, name)) for name in services],
        )
        of_node = dict(zip(nodes, uris, strict=False))
        of_service = dict(zip(services, uris[len(nodes) :], strict=False))
        before = self._uris.items()
        self._uris = {node: self._reachable(uri) for node, uri in of_node.items() if uri}
        self._ended &= self._uris.items()
        for node, uri in self._uris.items() - before:
            self._shared.prober.check(node, uri)
        return {
            Entry(
                role,
                name,
                node,
                self._uris[node],
                types.get(name, "*") if role != "service" else "",
                self._reachable(of_service[name]) if role == "service" else "",
            )
            for role, name, node in found
            if node in self._uris and (role != "service" or of_service[name])
            if (node, self._uris[node]) not in self._ended
        }

    def _reachable(self, uri: str) -> str:
        """Return a URI; on the master's machine if the host is not known here."""
        address = Address.parse(uri)
        try:
            socket.getaddrinfo(address.host, None, socket.AF_INET)
        except (OSError, UnicodeError):
            return uri.replace(f"//{address.host}:", f"//{self._address.host}:")
        return uri

    def _on_probe(self, node: str, uri: str, is_there: bool) -> None:
        """Take a node from the network that has ended: the master keeps its registrations."""
        if is_there == ((node, uri) in self._ended):
            (self._ended.discard if is_there else self._ended.add)((node, uri))
            self._look()

    def _apply(self, entries: set[Entry]) -> None:
        gone, new = self._entries - entries, entries - self._entries
        self._entries = entries
        changes = [Change(entry, alive=False) for entry in gone]
        changes += [Change(entry, alive=True) for entry in new]
        if changes:
            self._mirror.apply(changes)

    # What the network has, at the master.

    def _register(self, state: _State) -> None:
        """Register what the network publishes and serves, and unregister what it does not."""
        own, uri = self._shared.name, self._uri
        topics = self._offered(Kind.PUBLISHER, self._choice.topics)
        published, _, served = state
        for topic, type_name in topics.items():
            if own not in published.get(topic, ()):
                kind = ros1_type(topic, type_name)
                self._call("registerPublisher", topic, kind, uri)
        for topic, nodes in published.items():
            if own in nodes and topic not in topics:
                self._call("unregisterPublisher", topic, uri)
        services = self._offered(Kind.SERVICE, self._choice.services)
        for service in services:
            if service not in served:
                self._call("registerService", service, self._service_uri, uri)
        for service, nodes in served.items():
            if own in nodes and service not in services:
                self._call("unregisterService", service, self._service_uri)

    def _offered(self, kind: Kind, patterns: tuple[str, ...]) -> dict[str, str]:
        """Return names of ROS 1 with their types on the network."""
        shared = self._shared
        found = {}
        for token in shared.entities(kind):
            name = shared.there(token.name)
            if token.node_name.startswith(BRIDGE):
                continue
            if name is not None and matches(patterns, name):
                found[name] = token.type_name
        return found

    def _call(self, method: str, *args: Any) -> Any:
        return call(self._master, method, (self._shared.name, *args))

    def _leave(self) -> None:
        """Unregister everything."""
        own = self._shared.name
        try:
            self._unregister_all(own, self._uri, _read_state(self._call("getSystemState")))
        except RoszError as error:
            log.debug("the master has gone: %s", error)

    def _without_ended(self, state: _State) -> _State:
        """Return a state without bridges of this machine that were killed; unregister them."""
        host = Address.parse(self._uri).host
        ended = {
            node: uri
            for node, uri in self._ended
            if _is_bridge(node) and Address.parse(uri).host == host
        }
        for node, uri in ended.items():
            self._unregister_all(node, uri, state)
        return tuple(
            {
                name: found
                for name, nodes in known.items()
                if (found := [*set(nodes) - ended.keys()])
            }
            for known in state
        )

    def _unregister_all(self, node: str, uri: str, state: _State) -> None:
        """Unregister everything of a bridge."""
        published, _, served = state
        for topic in (name for name, nodes in published.items() if node in nodes):
            call(self._master, "unregisterPublisher", (node, topic, uri))
        for service in (name for name, nodes in served.items() if node in nodes):
            call(self._master, "unregisterService", (node, service, _service_uri(uri)))
        call(self._master, "unsubscribeParam", (node, uri, "/"))

    # Parameters.

    def _join_params(self) -> None:
        """Make the parameters of both equal; where they differ, the master's count."""
        theirs = self._call("subscribeParam", self._uri, "/")
        params, shared = self._shared.context.params, self._shared
        known = dict(_flat(theirs if isinstance(theirs, dict) else {}))
        changes = []
        for name, value in known.items():
            if self._crosses(name):
                path = split(shared.here(name))
                if params.lookup(path) != value:
                    changes.append((path, normalise(value, name)))
        params.write(changes, origin=shared.name)
        for name in params.names():
            there = shared.there(name)
            if there is not None and there not in known and self._crosses(there):
                self._send(there, params.peek(name))

    def _crosses(self, name: str) -> bool:
        own = any(name == each or name.startswith(f"{each}/") for each in _OWN_PARAMS)
        return not own and matches(self._choice.params, name)

    def _send(self, name: str, value: Any) -> None:
        try:
            if value is None:
                self._call("deleteParam", name)
            else:
                self._call("setParam", name, value)
        except EncodeError as error:
            log.warning("parameter '%s' stays here: %s", name, error)
        except RoszError as error:
            log.info("parameter '%s' is not set at the master: %s", name, error)

    def _changed(self, changed: Changed) -> None:
        """Pass a change on to the master; runs on the thread for watches."""
        name = self._shared.there(changed.name)
        if changed.origin != self._shared.name and name is not None and self._crosses(name):
            self._worker.submit(partial(self._send_if_active, name, changed.new))

    def _send_if_active(self, name: str, value: Any) -> None:
        if self._active:
            self._send(name, value)

    def _param_update(self, key: str, value: Any) -> None:
        """Take a change of the master; runs on a thread of the server."""
        name = f"/{key.strip('/')}"
        if not self._active or not self._crosses(name):
            return
        params, here = self._shared.context.params, self._shared.here(name)
        try:
            if value == {} and not self._call("hasParam", name):
                params.delete(here, origin=self._shared.name)
            elif not _same(params.lookup(split(here)), value):  # else it could go round a ring
                params.set(here, value, origin=self._shared.name)
        except ParamNotFound:
            return
        except RoszError as error:
            log.warning("parameter '%s' of ROS 1 is not set here: %s", name, error)


def _read_state(state: Any) -> _State:
    """Return the state that a master has told.

    Raises:
        DecodeError: It is not one.
    """
    return tuple(map(dict, _convert(state, tuple[_Names, _Names, _Names])))


def _convert(value: Any, kind: Any) -> Any:
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise DecodeError("state of the master", -1, str(error)) from error


def _service_uri(uri: str) -> str:
    """Return the URI of the services of a bridge, which has one port for all."""
    return uri.replace("http:", "rosrpc:").rstrip("/")


def _is_bridge(node: str) -> bool:
    return node.startswith(BRIDGE)


def _flat(tree: dict[str, Any]) -> Iterable[tuple[str, Any]]:
    return ((f"/{'/'.join(path)}", value) for path, value in leaves(tree) if path)


def _same(one: Any, other: Any) -> bool:
    return type(one) is type(other) and bool(one == other)


def _keep(node: str, reason: str) -> None:
    log.warning("node '%s' of ROS 1 goes on, although asked to end: %s", node, reason)


def _own_address(address: Address) -> str:
    """Return the address of this machine on the way to another one.

    Raises:
        TransportError: The host is not known, or cannot be reached.
    """
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect((address.host, address.port))
            found: str = probe.getsockname()[0]
            return found
    except (OSError, UnicodeError) as error:
        raise TransportError(f"cannot reach {address}: {error}") from error
