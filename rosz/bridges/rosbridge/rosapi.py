"""The services of ROS's package rosapi: names, types and parameters of the system.

The bridge answers calls of its clients here, without a call on the network. `RosApi.serve` makes
the services part of a node, as the program ``rosapi_node`` does.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import msgspec

from rosz.access import AccessPolicy
from rosz.actions import SEND
from rosz.bridges.clients import build
from rosz.bridges.rosbridge.plain import Plain, Spelling, converter
from rosz.errors import NotFoundError, RoszError, UsageError
from rosz.graph import View
from rosz.idl import full_name
from rosz.introspect import services_of_type
from rosz.message import Message, Service, shown_name, slot_type, slots
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.rosapi import srv
from rosz.msgs.rosapi.msg import TypeDef
from rosz.names import ros1_type, short_type
from rosz.node import Node
from rosz.wire import Kind, Token

_PREFIX = "/rosapi/"
_VERSION = {"ros1": (1, "noetic"), "ros2": (2, "jazzy")}
_OTHER_TYPES = {"action_servers": "GetActionServers", "get_ros_version": "GetROSVersion"}
"""Types of the services whose type does not follow from the name."""


class RosApi:
    """Answers the services of rosapi from a node's graph and parameter store.

    Args:
        node: The node.
    """

    def __init__(self, node: Node) -> None:
        self._node = node

    def has(self, service: str) -> bool:
        """Return whether a service is one of rosapi."""
        return service.startswith(_PREFIX) and service.removeprefix(_PREFIX) in _TYPES

    def call(self, service: str, args: Any, policy: AccessPolicy, spelling: Spelling) -> Plain:
        """Return the response to a call as plain values.

        Args:
            service: Full name of the service.
            args: Fields of the request.
            policy: Permissions of the caller.
            spelling: Spelling of types and fields in the response.

        Raises:
            RoszError: The caller lacks the permission, or an argument is wrong.
        """
        name = service.removeprefix(_PREFIX)
        kind = _TYPES[name]
        if name == "get_param" and isinstance(args, dict) and "default_value" in args:
            args = {**args, "default": args["default_value"]}  # the name of the field in ROS 2
            del args["default_value"]
        request = build(kind.Request, args or None, self._node.now())
        answer = getattr(_Answers(self._node, policy, spelling), name)
        return converter(kind.Response, spelling)(_respond(kind, answer, request))

    def serve(self, policy: AccessPolicy, spelling: Spelling) -> None:
        """Add the services to the node, in the namespace ``/rosapi``.

        Args:
            policy: Permissions of the callers.
            spelling: Spelling of types and fields in the responses.
        """
        answers = _Answers(self._node, policy, spelling)
        for name, kind in _TYPES.items():
            handle = partial(_respond, kind, getattr(answers, name))
            self._node.service(_PREFIX + name, kind, handle)


def _respond(kind: type[Service], answer: Callable[[Any], list[Any]], request: Any) -> Message:
    response: Message = kind.Response(*answer(request))
    return response


class _Answers:
    """One method for each service, of the same name; it returns the fields of the response."""

    def __init__(self, node: Node, policy: AccessPolicy, spelling: Spelling) -> None:
        self._node = node
        self._policy = policy
        self._spelling = spelling

    def _view(self) -> View:
        return self._node.context.graph.refresh()

    # Topics.

    def _typed_topics(self) -> dict[str, str]:
        types_by_name, in_ros1 = self._view().topics(), self._spelling == "ros1"
        return {
            name: ros1_type(name, types[0]) if in_ros1 else _spelt(types[0], self._spelling)
            for name, types in sorted(types_by_name.items())
            if self._policy.shows("topics", name) and "/_action/" not in name
        }

    def topics(self, _request: Any) -> list[Any]:
        types = self._typed_topics()
        return [list(types), list(types.values())]

    def topics_for_type(self, request: Any) -> list[Any]:
        wanted = _spelt(request.type, self._spelling)
        types = self._typed_topics()
        return [[name for name, type_name in types.items() if type_name == wanted]]

    def topics_and_raw_types(self, _request: Any) -> list[Any]:
        types = self._typed_topics()
        texts = [self._full_text(type_name) for type_name in types.values()]
        return [list(types), list(types.values()), texts]

    def _full_text(self, type_name: str) -> str:
        try:
            return str(self._node.context.types.message(type_name)._full_text)
        except RoszError:
            return ""

    def topic_type(self, request: Any) -> list[Any]:
        return [self._typed_topics().get(request.topic, "")]

    def publishers(self, request: Any) -> list[Any]:
        shown = self._policy.shows("topics", request.topic)
        return [_nodes_of(self._view().publishers(request.topic)) if shown else []]

    def subscribers(self, request: Any) -> list[Any]:
        shown = self._policy.shows("topics", request.topic)
        return [_nodes_of(self._view().subscriptions(request.topic)) if shown else []]

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
                if self._policy.shows("services" if kind is Kind.SERVICE else "topics", name)
            )
            for kind in (Kind.SUBSCRIPTION, Kind.PUBLISHER, Kind.SERVICE)
        }
        return list(shown.values())

    def services(self, _request: Any) -> list[Any]:
        names = sorted(self._view().services())
        return [[name for name in names if self._policy.shows("services", name)]]

    def services_for_type(self, request: Any) -> list[Any]:
        names = services_of_type(self._view(), request.type)
        return [[name for name in names if self._policy.shows("services", name)]]

    def _servers(self, name: str) -> list[Token]:
        return self._view().servers(name) if self._policy.shows("services", name) else []

    def service_type(self, request: Any) -> list[Any]:
        servers = self._servers(request.service)
        return [_spelt(servers[0].type_name, self._spelling) if servers else ""]

    def service_providers(self, request: Any) -> list[Any]:
        return [_nodes_of(self._servers(request.service))]

    def service_node(self, request: Any) -> list[Any]:
        nodes = _nodes_of(self._servers(request.service))
        return [nodes[0] if nodes else ""]

    def service_host(self, request: Any) -> list[Any]:
        view = self._view()
        hosts = [
            process.host
            for token in self._servers(request.service)
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
        return [sorted(name for name in names if self._policy.shows("topics", name))]

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
        self._policy.check("set", name)
        self._node.params.set(name, _from_json(name, request.value))
        return []

    def get_param(self, request: Any) -> list[Any]:
        name = self._param(request.name)
        self._policy.check("get", name)
        try:
            value = msgspec.json.encode(self._node.params.get(name), enc_hook=str).decode()
        except NotFoundError:
            value = request.default or "null"
        return [value]

    def has_param(self, request: Any) -> list[Any]:
        name = self._param(request.name)
        self._policy.check("get", name)
        return [self._node.params.has(name)]

    def search_param(self, request: Any) -> list[Any]:
        name = self._node.params.search(request.name) or ""
        self._policy.check("get", name or self._param(request.name))
        return [name]

    def delete_param(self, request: Any) -> list[Any]:
        name = self._param(request.name)
        self._policy.check("set", name)
        self._node.params.delete(name)
        return []

    def get_param_names(self, _request: Any) -> list[Any]:
        names = self._node.params.names()
        return [[name for name in names if not self._policy.objection("get", name)]]

    # Others.

    def get_time(self, _request: Any) -> list[Any]:
        return [Time.from_nsec(self._node.now())]

    def get_ros_version(self, _request: Any) -> list[Any]:
        version, distro = _VERSION[self._spelling]
        return [version, os.environ.get("ROS_DISTRO", distro)]


def _type_of(service: str) -> type[Service]:
    words = service.split("_")
    kind: type[Service] = getattr(srv, _OTHER_TYPES.get(service, "".join(map(str.title, words))))
    return kind


_TYPES = {name: _type_of(name) for name in vars(_Answers) if not name.startswith("_")}


def _from_json(name: str, text: str) -> Any:
    try:
        return msgspec.json.decode(text)
    except msgspec.MsgspecError as error:
        raise UsageError(f"the value of '{name}' is not JSON: {error}, in {text!r}") from error


def _spelt(type_name: str, spelling: Spelling) -> str:
    """Return the name of a type in a spelling."""
    return short_type(type_name) if spelling == "ros1" else full_name(type_name, "msg")


def _nodes_of(tokens: Iterable[Any]) -> list[str]:
    return sorted({token.node_name for token in tokens})


def _describe(cls: type[Message], spelling: Spelling) -> list[TypeDef]:
    """Return the descriptions of a message class and of all message classes in its fields."""
    descriptions: dict[type[Message], TypeDef] = {}
    waiting = [cls]
    while waiting:
        described = waiting.pop(0)
        if described in descriptions:
            continue
        descriptions[described] = _type_def(described, spelling)
        waiting += (slot.kind for slot in slots(described) if not isinstance(slot.kind, str))
    return list(descriptions.values())


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
