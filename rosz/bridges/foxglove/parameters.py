"""Parameters, as clients read, set and follow them.

All of it happens on one thread of its own, since a write waits for all copies of the store.
"""

from __future__ import annotations

import base64
import binascii
import datetime as dt
from collections.abc import Callable, Collection, Iterable
from functools import partial
from typing import Any, Literal

import msgspec

from rosz.access import AccessPolicy
from rosz.bridges.foxglove.catalog import CatalogMember
from rosz.bridges.foxglove.protocol import (
    FoxgloveParameter,
    GetParameters,
    SetParameters,
    SubscribeParameterUpdates,
    UnsubscribeParameterUpdates,
)
from rosz.errors import NotFoundError, RoszError, UsageError
from rosz.node import Node
from rosz.params import joined, leaves, split
from rosz.params.replica import Changed, Watch
from rosz.worker import Worker

ParameterRequest = (
    GetParameters | SetParameters | SubscribeParameterUpdates | UnsubscribeParameterUpdates
)
_WAITING = 1000
_ALL = "/"


class ClientParameters:
    """The parameters of the network, for the clients of a bridge."""

    def __init__(self, node: Node, policy: AccessPolicy) -> None:
        self._node = node
        self._policy = policy
        self._worker = Worker[Callable[[], object]](
            "rosz-foxglove-params", capacity=_WAITING, logger=node.log
        )
        self._followed: dict[CatalogMember, set[str]] = {}
        self._watch: Watch | None = None

    def handle(self, member: CatalogMember, request: ParameterRequest) -> None:
        """Handle a request of a client, soon."""
        if not self._worker.offer(partial(self._run, member, request)):
            member.report(f"{_WAITING} requests for parameters wait, which is the limit")

    def leave(self, member: CatalogMember) -> None:
        """Send a client no more changes."""
        self._worker.submit(partial(self._unfollow, member, ()))

    def close(self) -> None:
        """End all watches."""
        self._worker.close()
        if self._watch is not None:
            self._watch.close()

    # On the thread of the worker.

    def _run(self, member: CatalogMember, request: ParameterRequest) -> None:
        try:
            match request:
                case GetParameters(names, number):
                    _send(member, self._values(names), number)
                case SetParameters():
                    self._set(member, request)
                case SubscribeParameterUpdates(names):
                    self._follow(member, names)
                case UnsubscribeParameterUpdates(names):
                    self._unfollow(member, names)
        except RoszError as error:
            member.report(str(error))

    def _values(self, names: Iterable[str]) -> list[FoxgloveParameter]:
        """Return parameters that are set and that clients may read; all if none is named."""
        named = tuple(names)
        if named:
            for name in named:
                self._check("get", name)
        else:
            every = self._node.params.names()
            named = tuple(name for name in every if not self._policy.objection("get", name))
        return _with_value(map(self._value, named))

    def _check(self, verb: Literal["get", "set"], name: str) -> None:
        self._policy.check(verb, self._node.params.resolve(name))

    def _value(self, name: str) -> FoxgloveParameter:
        try:
            return _parameter(name, self._node.params.get(name))
        except NotFoundError:
            return FoxgloveParameter(name)

    def _set(self, member: CatalogMember, request: SetParameters) -> None:
        done = []
        try:
            for parameter in request.parameters:
                self._check("set", parameter.name)
                if parameter.value is not msgspec.UNSET:
                    self._node.params.set(parameter.name, _from_json(parameter))
                elif self._node.params.has(parameter.name):
                    self._node.params.delete(parameter.name)
                done.append(parameter)
        finally:
            if request.id is not None:
                _send(member, _with_value(done), request.id)

    # Following.

    def _follow(self, member: CatalogMember, names: Collection[str]) -> None:
        for name in names:
            self._check("get", name)
        self._followed.setdefault(member, set()).update(names or (_ALL,))
        if self._watch is None:
            self._watch = self._node.params.watch(_ALL, self._changed)

    def _unfollow(self, member: CatalogMember, names: Collection[str]) -> None:
        if names:
            self._followed.get(member, set()).difference_update(names)
        if not names or not self._followed.get(member):
            self._followed.pop(member, None)
        if not self._followed and self._watch is not None:
            self._watch.close()
            self._watch = None

    def _changed(self, change: Changed) -> None:
        """Report a change soon; on the thread of all watches of the process."""
        self._worker.submit(partial(self._report, change))

    def _report(self, change: Changed) -> None:
        changed = {*_leaves(change.name, change.old), *_leaves(change.name, change.new)}
        shown = {name for name in changed if not self._policy.objection("get", name)}
        for member, followed in self._followed.items():
            names = {name for name in followed if self._is_in(name, change.name)}
            if _ALL in followed:
                names |= shown
            if names:
                _send(member, [self._value(name) for name in sorted(names)], None)

    def _is_in(self, name: str, changed: str) -> bool:
        """Return whether a change is that of a name, or of one above or below it."""
        if name == _ALL:
            return False
        above, below = f"{changed.rstrip('/')}/", f"{self._node.params.resolve(name)}/"
        return below.startswith(above) or above.startswith(below)


def _leaves(name: str, value: Any) -> list[str]:
    """Return the names of the parameters in a value."""
    return [joined(path) for path, leaf in leaves(value, split(name)) if leaf is not None]


def _with_value(parameters: Iterable[FoxgloveParameter]) -> list[FoxgloveParameter]:
    return [parameter for parameter in parameters if parameter.value is not msgspec.UNSET]


def _send(member: CatalogMember, parameters: list[FoxgloveParameter], number: str | None) -> None:
    message = {"op": "parameterValues", "parameters": parameters}
    member.send(message if number is None else {**message, "id": number})


def _parameter(name: str, value: Any) -> FoxgloveParameter:
    """Return a parameter with the type that JSON does not show."""
    if isinstance(value, bytes):
        return FoxgloveParameter(name, base64.b64encode(value).decode(), "byte_array")
    if isinstance(value, float):
        return FoxgloveParameter(name, value, "float64")
    if isinstance(value, list) and value and all(isinstance(item, float) for item in value):
        return FoxgloveParameter(name, value, "float64_array")
    if isinstance(value, dt.datetime | dt.date):
        return FoxgloveParameter(name, value.isoformat())
    return FoxgloveParameter(name, value)


def _from_json(parameter: FoxgloveParameter) -> Any:
    """Return the value of a parameter that a client sets."""
    value, kind = parameter.value, parameter.type
    try:
        if kind == "byte_array":
            return base64.b64decode(value, validate=True)
        if kind == "float64":
            return float(value)
        if kind == "float64_array":
            return [float(item) for item in value]
    except (TypeError, ValueError, OverflowError, binascii.Error) as error:
        raise UsageError(
            f"the value of '{parameter.name}' is {value!r}: expected a {kind} ({error})"
        ) from error
    if kind:
        raise UsageError(
            f"the type of '{parameter.name}' is '{kind}': expected byte_array, float64,"
            " float64_array or none"
        )
    return value
