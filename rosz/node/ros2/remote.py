"""The parameters of another node, by the services that every node of ROS 2 has for them.

They are values at paths of rosz's parameter store here: the parameter ``gains.p`` of ``/talker`` is
``/talker/gains/p``.
"""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any, Final

from rosz.errors import DecodeError, ParamError, ParamNotFound, ServiceError, WaitTimeout
from rosz.message import Service as ServiceType
from rosz.msgs.rcl_interfaces.msg import Parameter, ParameterValue
from rosz.msgs.rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rosz.node.ros2.values import from_ros2, to_type
from rosz.params import DELETED, MISSING, Change, Missing, Path, Value, joined, leaves, split
from rosz.session import Replies, Session, clamp_timeout
from rosz.wire import NO_HASH, Token, entity_key, pack_attachment

SERVICES: Final[dict[str, type[ServiceType]]] = {
    "describe_parameters": DescribeParameters,
    "get_parameters": GetParameters,
    "get_parameter_types": GetParameterTypes,
    "list_parameters": ListParameters,
    "set_parameters": SetParameters,
    "set_parameters_atomically": SetParametersAtomically,
}
"""The types of the services by the last parts of their names."""

_ATTEMPTS = 10
_PAUSE = 0.02
"""Seconds between attempts: the route to a server comes up some milliseconds after its token."""


class RemoteParameters:
    """The parameters of a node of ROS 2, whatever program asks for them.

    Args:
        session: Session to call the services on.
        server: Token of the node or of one of the services.
        timeout: Time limit of each call in seconds.

    Attributes:
        node: Full name of the node.

    Raises:
        UsageError: The timeout is not a number.
    """

    def __init__(self, session: Session, server: Token, timeout: float = 5.0) -> None:
        self.node: str = server.node_name
        self._session = session
        self._server = server
        self._timeout = clamp_timeout(timeout)
        self._base = split(self.node)
        self._gid = os.urandom(16)
        self._numbers = itertools.count(1)

    def begin(self, service: str, *values: Any) -> Callable[[], Any]:
        """Call a service, and return the function that waits for the response.

        That function raises `WaitTimeout` if the node does not answer in time, and `ServiceError`
        if the node ends before, responds with an error or with damaged bytes.

        Args:
            service: Last part of the service's name.
            values: Values of the fields of the request.
        """
        kind = SERVICES[service]
        type_hash = NO_HASH if self._server.type_hash == NO_HASH else kind._type_hash
        domain, name = self._server.domain, f"{self.node}/{service}"
        key = entity_key(domain, name, kind._type_name, type_hash)
        request = kind.Request(*values)
        payload = request._encode(request)

        def send() -> Replies:
            attachment = pack_attachment(next(self._numbers), time.time_ns(), self._gid)
            options: Any = {"payload": payload, "attachment": attachment, "target": "all_complete"}
            return self._session.query(key, timeout=self._timeout, **options)

        return partial(self._response, kind, send(), send)

    def _response(
        self, kind: type[ServiceType], replies: Replies, send_again: Callable[[], Replies]
    ) -> Any:
        for _ in range(_ATTEMPTS):
            reply = replies.receive()
            if reply is not None:
                break
            time.sleep(_PAUSE)
            replies = send_again()
        else:
            raise ServiceError(f"node '{self.node}' does not serve parameters, or has ended")
        if not reply.ok:
            text = reply.payload.decode(errors="replace")
            if text != "Timeout":
                raise ServiceError(f"node '{self.node}' answered for its parameters: {text}")
            why = self._session.why_silent(self._server.zid) or "it hangs, or nobody spins it"
            what = f"answer of node '{self.node}' for its parameters"
            raise WaitTimeout(what, self._timeout, why)
        try:
            return kind.Response._decode(reply.payload)
        except DecodeError as error:
            text = f"node '{self.node}' sent a damaged answer for its parameters: {error}"
            raise ServiceError(text) from error

    def names(self, prefixes: Iterable[str] = ()) -> list[str]:
        """Return the names of the parameters, sorted; errors as those of `begin`."""
        return sorted(self.begin("list_parameters", list(prefixes), 0)().result.names)

    def values(self, names: Iterable[str]) -> list[ParameterValue]:
        """Return values; most nodes return none if one of the names is not declared."""
        values: list[ParameterValue] = self.begin("get_parameters", list(names))().values
        return values

    # As a part of the tree

    def paths(self, names: Iterable[str]) -> dict[Path, str]:
        """Return names of parameters by their paths."""
        return {self._path(name): name for name in names}

    def read(self, path: Path) -> list[tuple[Path, ParameterValue]]:
        """Return the values at a path and below it, for `tree_of`; errors as those of `begin`."""
        names = _at(path, self.paths(self.names()))
        values = self.values(names.values()) if names else ()
        return list(zip(names, values, strict=False))

    def get(self, path: Path) -> Value | Missing:
        """Return the value at a path, a dict if parameters lie below it; errors as of `begin`."""
        return tree_of(path, self.read(path))

    def write(self, changes: Iterable[Change]) -> None:
        """Set and delete parameters as one change; further errors are those of `begin`.

        A dict sets the parameters in it and keeps the others. An int becomes the float that the
        node has. Of several parameters, those that have their values already are not set again, so
        that a dump can be loaded although some of its parameters are read-only.

        Raises:
            ParamError: The node refuses it, or ROS 2 has no type for a value; none is changed then.
            ParamNotFound: A parameter to delete does not exist.
        """
        names = self.paths(self.names())
        wanted = dict(self._spread(changes, names))
        present = [names[path] for path in wanted if path in names]
        before = dict(zip(present, self.values(present) if present else (), strict=False))
        parameters = []
        for path, item in wanted.items():
            name = names.get(path) or ".".join(path[len(self._base) :])
            old = before.get(name, ParameterValue())
            new = ParameterValue() if item is DELETED else to_type(item, old.type, joined(path))
            if len(wanted) == 1 or new != old:
                parameters.append(Parameter(name, new))
        if not parameters:
            return
        result = self.begin("set_parameters_atomically", parameters)().result
        if not result.successful:
            given = ", ".join(f"'{joined(path)}'" for path in wanted)
            reason = result.reason or "it tells no reason"
            raise ParamError(f"node '{self.node}' refuses to set {given}: {reason}")

    def _spread(self, changes: Iterable[Change], names: dict[Path, str]) -> Iterator[Change]:
        for path, value in changes:
            if value is not DELETED:
                for below, item in leaves(value, path):
                    yield self._path(".".join(below[len(self._base) :])), item
                continue
            present = _at(path, names)
            if not present:
                raise ParamNotFound(joined(path), list(map(joined, names)))
            for below in present:
                yield below, DELETED

    def _path(self, name: str) -> Path:
        """Return the path of a parameter; a name may have empty parts (``qos_overrides./scan``)."""
        return *self._base, *filter(None, name.replace(".", "/").split("/"))


def tree_of(path: Path, values: Iterable[tuple[Path, ParameterValue]]) -> Value | Missing:
    """Return values at or below a path as one value; `MISSING` if there are none.

    Where a parameter has a value and others below it, these keep the rest of their dotted names.
    """
    tree: dict[str, Value] = {}
    for place, value in sorted(values, key=lambda item: item[0]):
        converted = from_ros2(value)
        if converted is DELETED:
            continue
        rest = list(place[len(path) :])
        if not rest:
            return converted
        inner = tree
        while len(rest) > 1 and type(inner.setdefault(rest[0], {})) is dict:
            inner = inner[rest.pop(0)]
        inner[".".join(rest)] = converted
    return tree or MISSING


def _at(path: Path, names: dict[Path, str]) -> dict[Path, str]:
    """Return those of some names that lie at or below a path."""
    return {place: name for place, name in names.items() if place[: len(path)] == path}
