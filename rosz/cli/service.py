"""``rosz service``: the commands of rosservice."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

from rosz.cli import suggest
from rosz.cli.call import Call, new_group
from rosz.cli.console import print_json, print_lines, print_result, until_stopped, warn
from rosz.cli.declare import Argument, Json, Option, seconds, values_last
from rosz.errors import RoszError, UsageError
from rosz.names import short_type

if TYPE_CHECKING:
    from rosz.node import Client
    from rosz.wire import Token

app = new_group("List and call services.")

_TOOL = "rosservice"
_ServiceName = Annotated[str, Argument("SERVICE", source=suggest.services)]


@app.command("list")
def list_command(
    call: Call,
    namespace: Annotated[
        str, Argument("NAMESPACE", "Lists all if omitted.", suggest.services)
    ] = "",
    *,
    nodes: Annotated[bool, Option("-n --nodes", "Print the nodes as well.")] = False,
    types: Annotated[bool, Option("-t --types", "Print the types as well.")] = False,
    json: Json = False,
) -> int:
    """List services."""
    from rosz.introspect import in_namespace, list_services

    space = call.resolve(namespace, _TOOL) if namespace else "/"
    services = [
        service
        for service in list_services(call.survey().view)
        if in_namespace(service.name, space)
    ]
    lines = (
        service.name
        + (f" [{', '.join(service.types)}]" if types else "")
        + (f" {','.join(service.nodes)}" if nodes else "")
        for service in services
    )
    print_result(lines, services, as_json=json)
    return int(call.incomplete)


@app.command("info")
def info_command(call: Call, service: _ServiceName, *, json: Json = False) -> None:
    """Print the node, the type and the arguments of a service."""
    from rosz.introspect import service_key

    token = _server(call, service)
    arguments = _arguments(call, token)
    type_name = short_type(token.type_name)
    key = service_key(token)
    row = {"name": token.name, "node": token.node_name, "uri": key, "type": type_name}
    print_result(
        [f"Node: {token.node_name}", f"URI: {key}", f"Type: {type_name}", f"Args: {arguments}"],
        row | {"args": arguments.split()},
        as_json=json,
    )


@app.command("type")
def type_command(call: Call, service: _ServiceName, *, json: Json = False) -> None:
    """Print the type of a service."""
    name = short_type(_server(call, service).type_name)
    print_result([name], {"type": name}, as_json=json)


@app.command("find")
def find_command(
    call: Call,
    type_name: Annotated[str, Argument("TYPE", source=suggest.service_types)],
    *,
    json: Json = False,
) -> None:
    """List the services of a type."""
    from rosz.introspect import services_of_type

    names = services_of_type(call.survey().view, type_name)
    print_result(names, names, as_json=json)


@app.command("args")
def args_command(call: Call, service: _ServiceName, *, json: Json = False) -> None:
    """Print the arguments of a service."""
    with _failing():
        names = _arguments(call, _server(call, service))
    print_result([names], {"args": names.split()}, as_json=json)


@app.command("node")
def node_command(call: Call, service: _ServiceName, *, json: Json = False) -> None:
    """Print the node that provides a service."""
    name = _server(call, service).node_name
    print_result([name], {"node": name}, as_json=json)


@app.command("uri")
def uri_command(call: Call, service: _ServiceName, *, json: Json = False) -> None:
    """Print the Zenoh key of a service."""
    from rosz.introspect import service_key

    key = service_key(_server(call, service))
    print_result([key], {"uri": key}, as_json=json)


def _server(call: Call, service: str) -> Token:
    from rosz.introspect import find_server

    return find_server(call.survey().view, call.resolve(service, _TOOL))


def _arguments(call: Call, token: Token) -> str:
    return " ".join(call.types.service(token.type_name).Request.__slots__)


@app.command("call", arrange=values_last("--timeout"))
def call_command(
    call: Call,
    service: _ServiceName,
    values: Annotated[
        list[str] | None,
        Argument(
            "VALUE",
            "The request in YAML: one dictionary, or one value per field; read from standard"
            " input if omitted.",
            suggest.request_values,
        ),
    ] = None,
    *,
    verbose: Annotated[bool, Option("-v", "Print the request as well.")] = False,
    wait: Annotated[bool, Option("--wait", "Wait for the service.")] = False,
    timeout: Annotated[float, Option("--timeout SECONDS", "Time limit for the response.")] = 3600.0,
    json: Json = False,
) -> None:
    """Call a service and print its response."""
    seconds("--timeout", timeout)
    from rosz.introspect import find_server, read_arguments, wait_for_server
    from rosz.message import to_jsonable  # noqa: F401  # used later; Ctrl-C must not interrupt an import
    from rosz.node import Node

    arguments = read_arguments(values or ())
    # A command that waits joins as a peer, so that it outlives the process at the rendezvous.
    with _failing(), until_stopped() as ready, call.context(lasting=wait) as context:
        ready()
        name = call.resolve(service, _TOOL)
        if wait:
            token = wait_for_server(context, name, warn)
        else:
            token = context.graph.find(lambda view: find_server(view, name))
        stopped = context.session.why_silent(token.zid)
        if stopped:
            warn(f"service [{token.name}] does not answer as long as {stopped}")
        service_type = context.types.service(token.type_name)
        with (
            Node(_TOOL, anonymous=True, context=context) as node,
            node.client(token.name, service_type, timeout=timeout) as client,
        ):
            for request in _requests(arguments, service_type.Request):
                _send(client, request, verbose=verbose, as_json=json)


@contextmanager
def _failing() -> Iterator[None]:
    """Report an error of the block with rosservice's exit code for it, that of wrong usage."""
    try:
        yield
    except RoszError as error:
        raise UsageError(str(error)) from error


def _requests(arguments: list[Any], request_type: Any) -> Iterable[list[Any]]:
    """Return the values of each request, from the command line or from standard input."""
    from rosz.introspect import list_arguments, read_stream

    if arguments or not request_type.__slots__:
        return [arguments]
    if sys.stdin.isatty():
        raise UsageError(f"no values are given; they are: {list_arguments(request_type)}")
    documents = read_stream(sys.stdin.buffer, warn)
    return (document if isinstance(document, list) else [document] for document in documents)


def _send(client: Client, values: Sequence[Any], *, verbose: bool, as_json: bool) -> None:
    from rosz.introspect import call_service, listing_arguments
    from rosz.message import to_jsonable

    with listing_arguments(client.service_type.Request):
        request, response = call_service(client, values, time.time_ns())
    if as_json:
        row = to_jsonable(response)
        print_json({"request": to_jsonable(request), "response": row} if verbose else row)
        return
    if verbose:
        print_lines([str(request), "---"])
    print_lines([str(response)])
