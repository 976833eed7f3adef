"""Parameters of nodes, by the services that every node of ROS 2 has."""

from __future__ import annotations

import re
from argparse import Namespace
from array import array
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosz.cli.console import print_error, print_lines
from rosz.cli.ros2.graph import CommandFailed, is_hidden, open_node, visible_nodes
from rosz.errors import ParamError, RoszError, WaitTimeout

if TYPE_CHECKING:
    from rosz.node import Node

_SERVICE_SECONDS = 5.0
_TYPES: tuple[tuple[str, str, str], ...] = (
    ("not set", "Parameter not set.", ""),
    ("boolean", "Boolean value is:", "bool_value"),
    ("integer", "Integer value is:", "integer_value"),
    ("double", "Double value is:", "double_value"),
    ("string", "String value is:", "string_value"),
    ("byte array", "Byte values are:", "byte_array_value"),
    ("boolean array", "Boolean values are:", "bool_array_value"),
    ("integer array", "Integer values are:", "integer_array_value"),
    ("double array", "Double values are:", "double_array_value"),
    ("string array", "String values are:", "string_array_value"),
)
"""By number: the name of a type, what ``get`` prints before a value, and the field of the value."""
_LISTS = {bool: 6, int: 7, float: 8, str: 9}
_SCALARS = {bool: 1, int: 2, float: 3}


class _Parameters:
    """The parameters of one node of the network."""

    def __init__(self, node: Node, name: str) -> None:
        self._node = node
        self.name = name

    def _call(self, service: str, *values: Any) -> Any:
        from rosz.msgs.rcl_interfaces import srv

        kind = getattr(srv, "".join(map(str.title, service.split("_"))))
        with self._node.client(f"{self.name}/{service}", kind) as client:
            try:
                client.wait_for_service(_SERVICE_SECONDS)
            except WaitTimeout as error:
                raise CommandFailed(
                    "Wait for service timed out waiting for parameter services for node"
                    f" {self.name}"
                ) from error
            try:
                return client(*values)
            except RoszError as error:
                raise CommandFailed(
                    f"Exception while calling service of node {self.name}: {error}"
                ) from error

    def names(self, prefixes: Sequence[str] = ()) -> list[str]:
        """Return the names of the parameters, sorted."""
        return sorted(self._call("list_parameters", list(prefixes), 0).result.names)

    def values(self, names: Sequence[str]) -> list[Any]:
        """Return values; none if the node does not know a name."""
        values: list[Any] = self._call("get_parameters", list(names)).values
        return values

    def descriptors(self, names: Sequence[str]) -> list[Any]:
        """Return the descriptors of parameters."""
        descriptors: list[Any] = self._call("describe_parameters", list(names)).descriptors
        return descriptors

    def set(self, values: dict[str, Any]) -> list[Any]:
        """Set parameters one by one, and return the results."""
        from rosz.msgs.rcl_interfaces.msg import Parameter

        parameters = [Parameter(name, value) for name, value in values.items()]
        results: list[Any] = self._call("set_parameters", parameters).results
        return results


@contextmanager
def _of_node(given: Namespace) -> Iterator[_Parameters]:
    """Find the node that the command line names."""
    name = f"/{given.node.removeprefix('/')}"
    with open_node() as node:
        graph = node.context.graph
        try:
            if is_hidden(name) and not given.hidden:
                raise CommandFailed("Node not found")
            if name not in graph.refresh().nodes():
                graph.wait_for_node(name, given.timeout)
        except WaitTimeout as error:
            raise CommandFailed("Node not found") from error
        yield _Parameters(node, name)


def _python(value: Any) -> Any:
    """Return a value as Python has it; None if it is not set."""
    field = _TYPES[value.type][2]
    raw: Any = getattr(value, field) if field else None
    return list(raw) if isinstance(raw, bytes | array) else raw


def _read_value(text: str) -> Any:
    """Return the value that a text on a command line means."""
    import yaml

    from rosz.msgs.rcl_interfaces.msg import ParameterValue

    try:
        value = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError):
        value = text
    return _to_value(value) or ParameterValue(4, string_value=text)


def _to_value(value: Any) -> Any:
    """Return a value as ROS 2 sends it; None if it has no type for it."""
    from rosz.msgs.rcl_interfaces.msg import ParameterValue

    number = _SCALARS.get(type(value), 4 if isinstance(value, str) else 0)
    if isinstance(value, list):
        number = next((n for kind, n in _LISTS.items() if {*map(type, value)} <= {kind}), 0)
    return ParameterValue(number, **{_TYPES[number][2]: value}) if number else None


def list_parameters(given: Namespace) -> str | None:
    """List the parameters of a node, or of all nodes."""
    pattern = re.compile(given.filter) if given.filter is not None else None
    with open_node() as node:
        names = sorted({*visible_nodes(node.context.graph.refresh(), hidden=given.hidden)})
        if given.node:
            wanted = f"/{given.node.removeprefix('/')}"
            names = [name for name in names if name == wanted]
            if not names:
                return "Node not found"
        for name in names:
            _list_of(_Parameters(node, name), given, pattern)
    return None


def _list_of(parameters: _Parameters, given: Namespace, pattern: re.Pattern[str] | None) -> None:
    try:
        names = parameters.names(given.param_prefixes)
    except CommandFailed as error:
        print_error(str(error))
        return
    shown = [name for name in names if pattern is None or pattern.match(name)]
    if shown and not given.node:
        print_lines([f"{parameters.name}:"])
    if given.param_type:
        kinds = {each.name: each.type for each in parameters.descriptors(shown)}
        print_lines(f"  {name} (type: {_TYPES[kinds.get(name, 0)][0]})" for name in shown)
    else:
        print_lines(f"  {name}" for name in shown)


def get(given: Namespace) -> str | None:
    """Print the value of a parameter."""
    with _of_node(given) as parameters:
        values = parameters.values([given.parameter])
        # A node that takes any parameter answers for one that it lacks.
        if values and not values[0].type and given.parameter not in parameters.names():
            values = []
    if not values:
        return "Parameter not set"
    label, value = _TYPES[values[0].type][1], _python(values[0])
    shown = value if given.hide_type else label if value is None else f"{label} {value}"
    print_lines([str(shown)])
    return None


def set_parameter(given: Namespace) -> None:
    """Set a parameter."""
    with _of_node(given) as parameters:
        (result,) = parameters.set({given.parameter: _read_value(given.value)})
    _print_result(result, "Set parameter successful", "Setting parameter failed")


def delete(given: Namespace) -> None:
    """Delete a parameter."""
    from rosz.msgs.rcl_interfaces.msg import ParameterValue

    with _of_node(given) as parameters:
        (result,) = parameters.set({given.parameter: ParameterValue()})
    _print_result(result, "Deleted parameter successfully", "Deleting parameter failed")


def _print_result(result: Any, success: str, failure: str) -> None:
    text = (success if result.successful else failure) + (
        f": {result.reason}" if result.reason else ""
    )
    if result.successful:
        print_lines([text])
    else:
        print_error(text)


def describe(given: Namespace) -> None:
    """Describe parameters."""
    with _of_node(given) as parameters:
        descriptors = parameters.descriptors(given.parameter_names)
    for each in descriptors:
        lines = [f"Parameter name: {each.name}", f"  Type: {_TYPES[each.type][0]}"]
        if each.description:
            lines.append(f"  Description: {each.description}")
        lines.append("  Constraints:")
        if each.read_only:
            lines.append("    Read only: true")
        for limits in [*each.floating_point_range, *each.integer_range][:1]:
            lines += [f"    Min value: {limits.from_value}", f"    Max value: {limits.to_value}"]
            lines += [f"    Step: {limits.step}"] if limits.step else []
        if each.additional_constraints:
            lines.append(f"    Additional constraints: {each.additional_constraints}")
        print_lines(lines)


def dump(given: Namespace) -> None:
    """Print the parameters of a node as a file of parameters."""
    import yaml

    with _of_node(given) as parameters:
        names = parameters.names()
        values = map(_python, parameters.values(names))
    tree: dict[str, Any] = {}
    for name, value in zip(names, values, strict=True):
        *above, last = name.split(".")
        inner = tree
        for part in above:
            inner = inner.setdefault(part, {})
        inner[last] = value
    print_lines([yaml.dump({parameters.name: {"ros__parameters": tree}})])


def load(given: Namespace) -> None:
    """Set the parameters that a file has for a node."""
    import yaml

    from rosz.params.ros2_file import sections

    with _of_node(given) as parameters:
        values: dict[str, Any] = {}
        try:
            tree = yaml.safe_load(Path(given.parameter_file).read_text("utf-8"))
            for name, own in sections(tree):
                if f"/{name.strip('/')}" in {
                    parameters.name,
                    *(["/**"] * (not given.no_use_wildcard)),
                }:
                    values |= own
        except (ParamError, yaml.YAMLError, UnicodeDecodeError) as error:
            raise CommandFailed(
                f"{given.parameter_file}: {' '.join(str(error).split())}"
            ) from error
        if not values:
            raise CommandFailed("Param file does not contain any valid parameters")
        converted = {name: _to_value(value) for name, value in values.items()}
        for name, value in converted.items():
            if value is None:
                raise CommandFailed(f"'{name}' has a value that ROS 2 has no type for")
        results = parameters.set(converted)
    for name, result in zip(values, results, strict=True):
        _print_result(result, f"Set parameter {name} successful", f"Set parameter {name} failed")
