"""Parameters of nodes, by the services that every node of ROS 2 has."""

from __future__ import annotations

import re
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosz.cli.console import print_error, print_lines
from rosz.cli.ros2.graph import CommandFailed, is_hidden, open_node, visible_nodes
from rosz.errors import ParamError, RoszError, WaitTimeout

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.node.ros2 import RemoteParameters

_SERVICE_SECONDS = 5.0
_CALL_SECONDS = 60.0
_EMPTY_LIST = 6
_TYPES = (
    ("not set", "Parameter not set."),
    ("boolean", "Boolean value is:"),
    ("integer", "Integer value is:"),
    ("double", "Double value is:"),
    ("string", "String value is:"),
    ("byte array", "Byte values are:"),
    ("boolean array", "Boolean values are:"),
    ("integer array", "Integer values are:"),
    ("double array", "Double values are:"),
    ("string array", "String values are:"),
)
"""By number: the name of a type, and what ``get`` prints before a value."""


@contextmanager
def _services_of(node: Node, name: str) -> Iterator[RemoteParameters]:
    """Wait for the services of a node, which nodes of rosz have when a client of one appears."""
    from rosz.node.ros2 import SERVICES, RemoteParameters

    with node.client(f"{name}/list_parameters", SERVICES["list_parameters"]) as client:
        try:
            client.wait_for_service(_SERVICE_SECONDS)
        except WaitTimeout as error:
            raise CommandFailed(
                f"Wait for service timed out waiting for parameter services for node {name}"
            ) from error
        server = client.others.view().servers(client.name)[0]
    try:
        yield RemoteParameters(node.context.session, server, _CALL_SECONDS)
    except CommandFailed:
        raise
    except RoszError as error:
        text = f"Exception while calling service of node {name}: {error}"
        raise CommandFailed(text) from error


@contextmanager
def _of_node(given: Namespace) -> Iterator[RemoteParameters]:
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
        with _services_of(node, name) as parameters:
            yield parameters


def _python(value: Any) -> Any:
    """Return a value as Python has it; None if it is not set."""
    from rosz.node.ros2 import from_ros2

    raw = from_ros2(value) if value.type else None
    return list(raw) if isinstance(raw, bytes) else raw


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
    from rosz.node.ros2 import to_type, type_of

    is_mixed = isinstance(value, list) and len({*map(type, value)}) > 1
    return to_type(value, _EMPTY_LIST, "") if type_of(value) and not is_mixed else None


def _describe(parameters: RemoteParameters, names: list[str]) -> list[Any]:
    descriptors: list[Any] = parameters.begin("describe_parameters", names)().descriptors
    return descriptors


def _put(parameters: RemoteParameters, values: list[Any]) -> list[Any]:
    results: list[Any] = parameters.begin("set_parameters", values)().results
    return results


def list_parameters(given: Namespace) -> str | None:
    """List the parameters of a node, or of all nodes."""
    pattern = re.compile(given.filter) if given.filter is not None else None
    with open_node() as node:
        names = sorted({*visible_nodes(node.context.graph.refresh(), hidden=given.hidden)})
        if given.node:
            names = [name for name in names if name == f"/{given.node.removeprefix('/')}"]
            if not names:
                return "Node not found"
        for name in names:
            try:
                with _services_of(node, name) as parameters:
                    _list_of(parameters, given, pattern)
            except CommandFailed as error:
                print_error(str(error))
    return None


def _list_of(
    parameters: RemoteParameters, given: Namespace, pattern: re.Pattern[str] | None
) -> None:
    names = parameters.names(given.param_prefixes)
    shown = [name for name in names if pattern is None or pattern.match(name)]
    if shown and not given.node:
        print_lines([f"{parameters.node}:"])
    if given.param_type:
        kinds = {each.name: each.type for each in _describe(parameters, shown)}
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
    from rosz.msgs.rcl_interfaces.msg import Parameter

    with _of_node(given) as parameters:
        (result,) = _put(parameters, [Parameter(given.parameter, _read_value(given.value))])
    _print_result(result, "Set parameter successful", "Setting parameter failed")


def delete(given: Namespace) -> None:
    """Delete a parameter."""
    from rosz.msgs.rcl_interfaces.msg import Parameter

    with _of_node(given) as parameters:
        (result,) = _put(parameters, [Parameter(given.parameter)])
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
        descriptors = _describe(parameters, given.parameter_names)
    for each in descriptors:
        lines = [f"Parameter name: {each.name}", f"  Type: {_TYPES[each.type][0]}"]
        if each.description:
            lines.append(f"  Description: {each.description}")
        lines.append("  Constraints:")
        if each.read_only:
            lines.append("    Read only: true")
        ranges: list[Any] = [*each.floating_point_range, *each.integer_range]
        for limits in ranges[:1]:
            lines += [f"    Min value: {limits.from_value}", f"    Max value: {limits.to_value}"]
            lines += [f"    Step: {limits.step}"] if limits.step else []
        if each.additional_constraints:
            lines.append(f"    Additional constraints: {each.additional_constraints}")
        print_lines(lines)


def dump(given: Namespace) -> None:
    """Print the parameters of a node as a file of parameters."""
    import yaml

    from rosz.params.ros2_file import nest

    with _of_node(given) as parameters:
        names = parameters.names()
        values = map(_python, parameters.values(names))
    tree = nest(dict(zip(names, values, strict=True)))
    print_lines([yaml.dump({parameters.node: {"ros__parameters": tree}})])


def load(given: Namespace) -> None:
    """Set the parameters that a file has for a node."""
    import yaml

    from rosz.msgs.rcl_interfaces.msg import Parameter
    from rosz.params.ros2_file import sections

    with _of_node(given) as parameters:
        values: dict[str, Any] = {}
        names = {parameters.node} if given.no_use_wildcard else {parameters.node, "/**"}
        try:
            tree = yaml.safe_load(Path(given.parameter_file).read_text("utf-8"))
            for name, own in sections(tree):
                if f"/{name.strip('/')}" in names:
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
        results = _put(parameters, [Parameter(*item) for item in converted.items()])
    for name, result in zip(values, results, strict=True):
        _print_result(result, f"Set parameter {name} successful", f"Set parameter {name} failed")
