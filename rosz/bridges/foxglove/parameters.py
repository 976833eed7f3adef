"""Parameters, as clients read, set and follow them.

All of it happens on one thread of its own, since a write waits for all copies of the store.
"""

from __future__ import annotations

import base64
import binascii
import datetime as dt
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, Protocol

import msgspec

from rosz.bridges.foxglove.protocol import GetParameters, Parameter, SetParameters
from rosz.bridges.gate import Gate
from rosz.errors import NotFoundError, RoszError, UsageError
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.params.replica import Changed, Watch

__all__ = ("Parameters",)

_WAITING = 1000
_ALL = "/"


class _Member(Protocol):
    """A client, as the parameters see it."""

    def send(self, value: Mapping[str, Any]) -> None:
        """Send a message."""

    def report(self, text: str) -> None:
        """Send an error."""


class Parameters:
    """The parameters of the network, for the clients of a bridge.

    Args:
        node: The node of the bridge.
        gate: Permissions of the clients.
    """

    def __init__(self, node: Node, gate: Gate) -> None:
        self._node = node
        self._gate = gate
        self._worker = Worker[Callable[[], object]](
            "rosz-foxglove-params", capacity=_WAITING, logger=node.log
        )
        self._followed: dict[_Member, set[str]] = {}
        self._watch: Watch | None = None

    def get(self, member: _Member, request: GetParameters) -> None:
        """Send parameters to a client."""
        self._submit(member, partial(self._get, member, request))

    def set(self, member: _Member, request: SetParameters) -> None:
        """Set parameters, or delete those without a value."""
        self._submit(member, partial(self._set, member, request))

    def follow(self, member: _Member, names: Iterable[str]) -> None:
        """Send a client parameters when they change; all if it names none."""
        self._submit(member, partial(self._follow, member, tuple(names)))

    def unfollow(self, member: _Member, names: Iterable[str] = ()) -> None:
        """Send a client no more changes of some parameters; of none if it names none."""
        self._worker.submit(partial(self._unfollow, member, tuple(names)))

    def close(self) -> None:
        """End what clients follow."""
        self._worker.close()
        if self._watch is not None:
            self._watch.close()

    def _submit(self, member: _Member, task: Callable[[], object]) -> None:
        if not self._worker.offer(partial(self._run, member, task)):
            member.report(f"{_WAITING} requests for parameters wait, which is the limit")

    # On the thread of the worker.

    def _run(self, member: _Member, task: Callable[[], object]) -> None:
        try:
            task()
        except RoszError as error:
            member.report(str(error))

    def _get(self, member: _Member, request: GetParameters) -> None:
        _send(member, self._values(request.parameter_names), request.id)

    def _values(self, names: Iterable[str]) -> list[Parameter]:
        """Return parameters that are set and that clients may read; all if none is named."""
        named = tuple(names)
        if named:
            for name in named:
                self._check("get", name)
        else:
            known = self._node.params.names()
            named = tuple(name for name in known if not self._gate.objection("get", name))
        found = map(self._value, named)
        return [one for one in found if one.value is not msgspec.UNSET]

    def _check(self, verb: Literal["get", "set"], name: str) -> None:
        self._gate.check(verb, self._node.params.resolve(name))

    def _value(self, name: str) -> Parameter:
        try:
            return _parameter(name, self._node.params.get(name))
        except NotFoundError:
            return Parameter(name)

    def _set(self, member: _Member, request: SetParameters) -> None:
        done = []
        try:
            for one in request.parameters:
                self._check("set", one.name)
                if one.value is not msgspec.UNSET:
                    self._node.params.set(one.name, _from_json(one))
                elif self._node.params.has(one.name):
                    self._node.params.delete(one.name)
                done.append(one)
        finally:
            if request.id is not None:
                _send(member, [one for one in done if one.value is not msgspec.UNSET], request.id)

    # Following.

    def _follow(self, member: _Member, names: tuple[str, ...]) -> None:
        for name in names:
            self._check("get", name)
        self._followed.setdefault(member, set()).update(names or (_ALL,))
        if self._watch is None:
            self._watch = self._node.params.watch(_ALL, self._changed)

    def _unfollow(self, member: _Member, names: tuple[str, ...]) -> None:
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
        leaves = {*_leaves(change.name, change.old), *_leaves(change.name, change.new)}
        shown = {name for name in leaves if not self._gate.objection("get", name)}
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
    if not isinstance(value, dict):
        return [] if value is None else [name]
    return [
        leaf for key, below in value.items() for leaf in _leaves(f"{name.rstrip('/')}/{key}", below)
    ]


def _send(member: _Member, parameters: list[Parameter], number: str | None) -> None:
    message = {"op": "parameterValues", "parameters": parameters}
    member.send(message if number is None else {**message, "id": number})


def _parameter(name: str, value: Any) -> Parameter:
    """Return a parameter with the type that JSON does not show."""
    if isinstance(value, bytes):
        return Parameter(name, base64.b64encode(value).decode(), "byte_array")
    if isinstance(value, float):
        return Parameter(name, value, "float64")
    if isinstance(value, list) and value and all(isinstance(one, float) for one in value):
        return Parameter(name, value, "float64_array")
    if isinstance(value, dt.datetime | dt.date):
        return Parameter(name, value.isoformat())
    return Parameter(name, value)


def _from_json(parameter: Parameter) -> Any:
    """Return the value of a parameter that a client sets.

    Raises:
        UsageError: It is not of the type that the client names.
    """
    value, kind = parameter.value, parameter.type
    try:
        if kind == "byte_array":
            return base64.b64decode(value, validate=True)
        if kind == "float64":
            return float(value)
        if kind == "float64_array":
            return [float(one) for one in value]
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
