"""A node as ROS 2's rclcpp makes it, to the extent of its parameters, on a plain Zenoh session."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import zenoh
from network import TIMEOUT

from rosz.msgs.rcl_interfaces.msg import (
    ListParametersResult,
    Parameter,
    ParameterDescriptor,
    ParameterValue,
    SetParametersResult,
)
from rosz.node.ros2 import SERVICES, to_ros2
from rosz.qos import PARAMETERS
from rosz.wire import Kind, Token, entity_key, format_token, pack_attachment, read_attachment

from .plain import Plain, plain_session

__all__ = ("Ros2Node", "ros2_node")

SCALARS = ("bool", "integer", "double", "string")
TYPES = ("not set", *SCALARS, "byte_array", *(f"{kind}_array" for kind in SCALARS))


class Ros2Node:
    """It.

    Attributes:
        values: The declared parameters.
        read_only: Names of those that nobody may set.
        calls: Last parts of the names of the services that were called.
        answering: What a call waits for.
    """

    def __init__(self, plain: Plain, domain: int, name: str, **values: Any) -> None:
        self._base = Token(domain, str(plain.session.zid()), 0, 0, Kind.NODE, "/", name)
        self.values: dict[str, ParameterValue] = {
            name.replace("__", "."): to_ros2(value) for name, value in values.items()
        }
        self.read_only: set[str] = set()
        self.calls: list[str] = []
        self.answering = threading.Event()
        self.answering.set()
        self._queries: Any = plain.queries(f"{domain}/{name}/*/*/*")
        self._keys: dict[str, str] = {}
        threading.Thread(
            target=self._run, args=(iter(self._queries.get, None),), daemon=True
        ).start()
        for number, (service, kind) in enumerate(SERVICES.items(), 1):
            full = f"/{name}/{service}"
            key = entity_key(domain, full, kind._type_name, kind._type_hash)
            self._keys[key] = service
            token = Token(
                *(domain, self._base.zid, 0, number, Kind.SERVICE, "/", name),
                name=full,
                type_name=kind._type_name,
                type_hash=kind._type_hash,
                qos=PARAMETERS,
            )
            plain.token(format_token(token))
        plain.token(format_token(self._base))

    def close(self) -> None:
        self._queries.put(None)
        self.answering.set()

    def get(self, name: str) -> Any:
        """Return a value as the message has it."""
        value = self.values[name]
        return getattr(value, f"{TYPES[value.type]}_value")

    def _run(self, queries: Iterator[zenoh.Query]) -> None:
        for query in queries:
            self.answering.wait(TIMEOUT)
            service = self._keys.get(str(query.key_expr))
            if service is not None:
                kind = SERVICES[service]
                assert query.payload is not None
                assert query.attachment is not None
                number, _, gid = read_attachment(query.attachment.to_bytes())
                request = kind.Request._decode(query.payload.to_bytes())
                handler: Callable[[Any], Any] = getattr(self, f"_{service}")
                response = handler(request)
                self.calls.append(service)
                query.reply(
                    query.key_expr,
                    kind.Response._encode(response),
                    attachment=pack_attachment(number, 1, gid),
                )
            query.drop()  # type: ignore[no-untyped-call]  # missing in zenoh's stub

    def _list_parameters(self, request: Any) -> Any:
        assert (request.prefixes, request.depth) == ([], 0)
        names = sorted(self.values)
        return SERVICES["list_parameters"].Response(ListParametersResult(names, []))

    def _get_parameters(self, request: Any) -> Any:
        known = [self.values[name] for name in request.names if name in self.values]
        complete = len(known) == len(request.names)
        return SERVICES["get_parameters"].Response(known if complete else [])

    def _get_parameter_types(self, request: Any) -> Any:
        values = self._get_parameters(request).values
        return SERVICES["get_parameter_types"].Response(bytes(value.type for value in values))

    def _describe_parameters(self, request: Any) -> Any:
        return SERVICES["describe_parameters"].Response(
            [
                ParameterDescriptor(name, self.values[name].type, read_only=name in self.read_only)
                for name in request.names
            ]
        )

    def _set_parameters(self, request: Any) -> Any:
        return SERVICES["set_parameters"].Response(
            [self._put([each]) for each in request.parameters]
        )

    def _set_parameters_atomically(self, request: Any) -> Any:
        return SERVICES["set_parameters_atomically"].Response(self._put(request.parameters))

    def _put(self, parameters: Iterable[Parameter]) -> SetParametersResult:
        reason = next(filter(None, map(self._refusal, parameters)), "")
        if not reason:
            self.values |= {parameter.name: parameter.value for parameter in parameters}
        return SetParametersResult(not reason, reason)

    def _refusal(self, parameter: Parameter) -> str:
        name, given = parameter.name, parameter.value.type
        if name not in self.values:
            return f"parameter '{name}' cannot be set because it was not declared"
        if name in self.read_only:
            return f"parameter '{name}' cannot be set because it is read-only"
        declared = self.values[name].type
        if given != declared:
            return (
                f"Wrong parameter type, parameter {{{name}}} is of type {{{TYPES[declared]}}},"
                f" setting it to {{{TYPES[given]}}} is not allowed."
            )
        return ""


@contextmanager
def ros2_node(rendezvous: str, domain: int, name: str, **values: Any) -> Iterator[Ros2Node]:
    """Have such a node on a session of its own; ``__`` in the name of a parameter is a dot."""
    with plain_session(rendezvous) as plain:
        node = Ros2Node(plain, domain, name, **values)
        try:
            yield node
        finally:
            node.close()
