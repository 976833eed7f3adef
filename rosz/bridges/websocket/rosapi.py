"""The services of ROS's package rosapi: what there is in the system, and its parameters.

Clients of the bridge get their answers here without a call on the network. `RosApi.serve` makes
them services of a node, as the program ``rosapi_node`` does.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from functools import partial
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.bridges.gate import Gate
from rosz.bridges.websocket.messages import build
from rosz.bridges.websocket.plain import Plain, Spelling, converter
from rosz.errors import NotFoundError, RoszError, UsageError
from rosz.introspect.services import services_of_type
from rosz.message import Message, Service, slot_type, slots
from rosz.message.convert import shown_name
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.rosapi import srv
from rosz.msgs.rosapi.msg import TypeDef
from rosz.names import ros1_type, short_type
from rosz.node.goals import SEND
from rosz.wire import Kind

if TYPE_CHECKING:
    from rosz.graph import View
    from rosz.node import Node

__all__ = ("RosApi",)

_PREFIX = "/rosapi/"
_VERSION = {"ros1": (1, "noetic"), "ros2": (2, "jazzy")}


_TYPES: dict[str, type[Service]] = {
    "topics": srv.Topics,
    "topics_for_type": srv.TopicsForType,
    "topics_and_raw_types": srv.TopicsAndRawTypes,
    "services": srv.Services,
    "services_for_type": srv.ServicesForType,
    "nodes": srv.Nodes,
    "node_details": srv.NodeDetails,
    "action_servers": srv.GetActionServers,
    "topic_type": srv.TopicType,
    "service_type": srv.ServiceType,
    "publishers": srv.Publishers,
    "subscribers": srv.Subscribers,
    "service_providers": srv.ServiceProviders,
    "service_node": srv.ServiceNode,
    "service_host": srv.ServiceHost,
    "message_details": srv.MessageDetails,
    "service_request_details": srv.ServiceRequestDetails,
    "service_response_details": srv.ServiceResponseDetails,
    "set_param": srv.SetParam,
    "get_param": srv.GetParam,
    "has_param": srv.HasParam,
    "search_param": srv.SearchParam,
    "delete_param": srv.DeleteParam,
    "get_param_names": srv.GetParamNames,
    "get_time": srv.GetTime,
    "get_ros_version": srv.GetROSVersion,
}


class RosApi:
    """The services, answered from the graph and the parameter store as a node sees them.

    Args:
        node: The node.
    """

    def __init__(self, node: Node) -> None:
        self._node = node

    def has(self, service: str) -> bool:
        """Return whether a service is one of these."""
        return service.startswith(_PREFIX) and service.removeprefix(_PREFIX) in _TYPES

    def call(self, service: str, args: Any, gate: Gate, spelling: Spelling) -> Plain:
        """Answer a call with plain values.

        Args:
            service: Full name of the service.
            args: Fields of the request.
            gate: Permissions of the caller.
            spelling: Whose names of types and fields the answer has.

        Raises:
            RoszError: The caller may not, or the arguments do not fit.
        """
        name = service.removeprefix(_PREFIX)
        kind = _TYPES[name]
        if name == "get_param" and isinstance(args, dict) and "default_value" in args:
            args = {**args, "default": args["default_value"]}  # the name that it has in ROS 2
            del args["default_value"]
        request = build(kind.Request, args or None, self._node.now())
        answer = getattr(_Answers(self._node, gate, spelling), name)
        return converter(kind.Response, spelling)(_respond(kind, answer, request))

    def serve(self, gate: Gate, spelling: Spelling) -> None:
        """Make them services of the node, below the name ``/rosapi``.

        Args:
            gate: Permissions of the callers.
            spelling: Whose names of types and fields the answers have.
        """
        answers = _Answers(self._node, gate, spelling)
        for name, kind in _TYPES.items():
            handle = partial(_respond, kind, getattr(answers, name))
            self._node.service(_PREFIX + name, kind, handle)


def _respond(kind: type[Service], answer: Callable[[Any], list[Any]], request: Any) -> Message:
    response: Message = kind.Response(*answer(request))
    return response


class _Answers:
    """The functions of the services; each returns the fields of a response."""

    def __init__(self, node: Node, gate: Gate, spelling: Spelling) -> None:
        self._node = node
        self._gate = gate
        self._spelling = spelling

    def _view(self) -> View:
        return self._node.context.graph.refresh()

    # Topics.

    def _typed_topics(self) -> dict[str, str]:
        known = self._view().topics()
        return {
            name: _spelt_topic(name, types[0], self._spelling)
            for name, types in sorted(known.items())
            if self._gate.shows("topics", name) and "/_action/" not in name
        }

    def topics(self, _request: Any) -> list[Any]:
        found = self._typed_topics()
        return [list(found), list(found.values())]

    def topics_for_type(self, request: Any) -> list[Any]:
        wanted = _spelt(request.type, self._spelling)
        found = self._typed_topics()
        return [[name for name, one in found.items() if one == wanted]]

    def topics_and_raw_types(self, _request: Any) -> list[Any]:
        found = self._typed_topics()
        texts = [self._full_text(type_name) for type_name in found.values()]
        return [list(found), list(found.values()), texts]

    def _full_text(self, type_name: str) -> str:
        try:
            return str(self._node.context.types.message(type_name)._full_text)
        except RoszError:
            return ""

    def topic_type(self, request: Any) -> list[Any]:
        found = self._typed_topics()
        return [found.get(request.topic, "")]

    def publishers(self, request: Any) -> list[Any]:
        return [_nodes_of(self._view().publishers(request.topic))]

    def subscribers(self, request: Any) -> list[Any]:
        return [_nodes_of(self._view().subscriptions(request.topic))]

    # Nodes, services and actions.

    def nodes(self, _request: Any) -> list[Any]:
        return [sorted(self._view().nodes())]

    def node_details(self, request: Any) -> list[Any]:
        names: dict[Kind, set[str]] = {}
        for token in self._view().entities(*Kind):
            if token.node_name == request.node:
                names.setdefault(token.kind, set()).add(token.name)
        shown = {
            kind: sorted(
                name
                for name in names.get(kind, ())
                if self._gate.shows("services" if kind is Kind.SERVICE else "topics", name)
            )
            for kind in (Kind.SUBSCRIPTION, Kind.PUBLISHER, Kind.SERVICE)
        }
        return list(shown.values())

    def services(self, _request: Any) -> list[Any]:
        names = sorted(self._view().services())
        return [[one for one in names if self._gate.shows("services", one)]]

    def services_for_type(self, request: Any) -> list[Any]:
        names = services_of_type(self._view(), request.type)
        return [[one for one in names if self._gate.shows("services", one)]]

    def service_type(self, request: Any) -> list[Any]:
        servers = self._view().servers(request.service)
        return [_spelt(servers[0].type_name, self._spelling) if servers else ""]

    def service_providers(self, request: Any) -> list[Any]:
        return [_nodes_of(self._view().servers(request.service))]

    def service_node(self, request: Any) -> list[Any]:
        nodes = _nodes_of(self._view().servers(request.service))
        return [nodes[0] if nodes else ""]

    def service_host(self, request: Any) -> list[Any]:
        view = self._view()
        hosts = [
            process.host
            for token in view.servers(request.service)
            for process in view.processes(token.node_name)
        ]
        return [hosts[0] if hosts else ""]

    def action_servers(self, _request: Any) -> list[Any]:
        view = self._view()
        names = {name.removesuffix(f"/{SEND}") for name in view.services() if name.endswith(SEND)}
        # An actionlib server subscribes to goals and publishes results.
        for name in view.topics():
            base = name.removesuffix("/goal")
            if base != name and view.subscriptions(name) and view.publishers(f"{base}/result"):
                names.add(base)
        shown = sorted(name for name in names if self._gate.shows("topics", name))
        return [shown]

    # Types.

    def message_details(self, request: Any) -> list[Any]:
        cls = self._node.context.types.message(request.type)
        return [_describe(cls, self._spelling)]

    def service_request_details(self, request: Any) -> list[Any]:
        cls = self._node.context.types.service(request.type).Request
        return [_describe(cls, self._spelling)]

    def service_response_details(self, request: Any) -> list[Any]:
        cls = self._node.context.types.service(request.type).Response
        return [_describe(cls, self._spelling)]

    # Parameters.

    def _param(self, name: str) -> str:
        """Return the full name of a parameter; ROS 2's clients write ``/node:name``."""
        node, colon, param = name.partition(":")
        return self._node.resolve(f"{node}/{param.replace('.', '/')}" if colon else name)

    def set_param(self, request: Any) -> list[Any]:
        name = self._param(request.name)
        self._gate.check("set", name)
        self._node.params.set(name, _from_json(name, request.value))
        return []

    def get_param(self, request: Any) -> list[Any]:
        name = self._param(request.name)
        self._gate.check("get", name)
        default = request.default or "null"
        try:
            value = msgspec.json.encode(self._node.params.get(name), enc_hook=str).decode()
        except NotFoundError:
            value = default
        return [value]

    def has_param(self, request: Any) -> list[Any]:
        name = self._param(request.name)
        self._gate.check("get", name)
        return [self._node.params.has(name)]

    def search_param(self, request: Any) -> list[Any]:
        found = self._node.params.search(request.name) or ""
        self._gate.check("get", found or self._param(request.name))
        return [found]

    def delete_param(self, request: Any) -> list[Any]:
        name = self._param(request.name)
        self._gate.check("set", name)
        self._node.params.delete(name)
        return []

    def get_param_names(self, _request: Any) -> list[Any]:
        names = [
            name for name in self._node.params.names() if not self._gate.objection("get", name)
        ]
        return [names]

    # Others.

    def get_time(self, _request: Any) -> list[Any]:
        return [Time.from_nsec(self._node.now())]

    def get_ros_version(self, _request: Any) -> list[Any]:
        version, distro = _VERSION[self._spelling]
        return [version, os.environ.get("ROS_DISTRO", distro)]


def _from_json(name: str, text: str) -> Any:
    try:
        return msgspec.json.decode(text)
    except msgspec.MsgspecError as error:
        raise UsageError(f"the value of '{name}' is not JSON: {error}, in {text!r}") from error


def _spelt(type_name: str, spelling: Spelling) -> str:
    """Return the name of a type in a spelling."""
    if spelling == "ros1" or type_name.count("/") > 1:
        return short_type(type_name) if spelling == "ros1" else type_name
    package, _, name = type_name.partition("/")
    return f"{package}/msg/{name}"


def _spelt_topic(topic: str, type_name: str, spelling: Spelling) -> str:
    return ros1_type(topic, type_name) if spelling == "ros1" else _spelt(type_name, spelling)


def _nodes_of(tokens: Iterable[Any]) -> list[str]:
    return sorted({token.node_name for token in tokens})


def _describe(cls: type[Message], spelling: Spelling) -> list[TypeDef]:
    """Return descriptions of a message class and of all classes in it, each once."""
    found: dict[type[Message], TypeDef] = {}
    waiting = [cls]
    while waiting:
        one = waiting.pop(0)
        if one in found:
            continue
        found[one] = _type_def(one, spelling)
        waiting += (slot.kind for slot in slots(one) if not isinstance(slot.kind, str))
    return list(found.values())


def _type_def(cls: type[Message], spelling: Spelling) -> TypeDef:
    fields = slots(cls)
    default = converter(cls, spelling)(cls())
    lengths = [{"one": -1, "fixed": slot.size}.get(slot.shape, 0) for slot in fields]
    examples = [
        [] if length >= 0 else default.get(slot.name, "") if isinstance(slot.kind, str) else {}
        for slot, length in zip(fields, lengths, strict=True)
    ]
    constants = _constants(cls)
    return TypeDef(
        _spelt(cls._type, spelling),
        [shown_name(slot.name) for slot in fields],
        [_field_type(slot, spelling) for slot in fields],
        lengths,
        list(map(str, examples)),
        list(constants),
        list(map(str, constants.values())),
    )


def _field_type(slot: Any, spelling: Spelling) -> str:
    if isinstance(slot.kind, str):
        return str(slot.kind)
    return slot_type(slot).partition("[")[0] if spelling == "ros1" else slot.kind._type_name


def _constants(cls: type[Message]) -> dict[str, Any]:
    fields = {*cls.__struct_fields__}
    return {
        name: value
        for name, value in vars(cls).items()
        if not name.startswith("_")
        and name not in fields
        and isinstance(value, bool | int | float | str | bytes)
    }
