"""``rosz service``: what rosservice does."""

from __future__ import annotations

from typing import Annotated

from rosz.cli.bounds import seconds
from rosz.cli.declare import Argument, Context, Option, values_last
from rosz.cli.group import call_of, new_group, print_json, print_lines

__all__ = ("app",)

app = new_group("List and call services.")

_TOOL = "rosservice"
_Json = Annotated[bool, Option("--json", help="As JSON.")]
_ServiceName = Annotated[str, Argument(metavar="SERVICE")]


@app.command("list")
def list_command(
    context: Context,
    namespace: Annotated[str, Argument(metavar="[NAMESPACE]")] = "",
    *,
    nodes: Annotated[bool, Option("-n", "--nodes", help="With the nodes.")] = False,
    types: Annotated[bool, Option("-t", "--types", help="With types.")] = False,
    json: _Json = False,
) -> None:
    """List services."""
    from rosz.introspect import services as library
    from rosz.introspect.topics import in_namespace

    call = call_of(context)
    space = call.resolve(namespace, _TOOL) if namespace else "/"
    entries = [
        entry
        for entry in library.list_services(call.survey().view)
        if in_namespace(entry.name, space)
    ]
    if json:
        print_json(entries)
        return
    for entry in entries:
        kind = f" [{', '.join(entry.types)}]" if types else ""
        print_lines([entry.name + kind + (f" {','.join(entry.nodes)}" if nodes else "")])


@app.command("info")
def info_command(context: Context, service: _ServiceName, *, json: _Json = False) -> None:
    """Tell who serves a service, of what type and with what arguments."""
    from rosz.introspect import services as library
    from rosz.introspect.arguments import list_arguments
    from rosz.names import short_type

    call = call_of(context)
    token = library.find_server(call.survey().view, call.resolve(service, _TOOL))
    arguments = list_arguments(call.types.service(token.type_name).Request)
    type_name = short_type(token.type_name)
    if json:
        row = {"name": token.name, "node": token.node_name, "uri": library.service_key(token)}
        print_json(row | {"type": type_name, "args": arguments.split()})
        return
    print_lines(
        [
            f"Node: {token.node_name}",
            f"URI: {library.service_key(token)}",
            f"Type: {type_name}",
            f"Args: {arguments}",
        ]
    )


@app.command("type")
def type_command(context: Context, service: _ServiceName, *, json: _Json = False) -> None:
    """Print the type of a service."""
    from rosz.introspect.services import find_server
    from rosz.names import short_type

    call = call_of(context)
    name = short_type(find_server(call.survey().view, call.resolve(service, _TOOL)).type_name)
    _print_one("type", name, as_json=json)


def _print_one(title: str, value: str, *, as_json: bool) -> None:
    if as_json:
        print_json({title: value})
    else:
        print_lines([value])


@app.command("find")
def find_command(
    context: Context,
    type_name: Annotated[str, Argument(metavar="TYPE")],
    *,
    json: _Json = False,
) -> None:
    """List the services of a type."""
    from rosz.introspect.services import services_of_type

    found = services_of_type(call_of(context).survey().view, type_name)
    if json:
        print_json(found)
    else:
        print_lines(found)


@app.command("args")
def args_command(context: Context, service: _ServiceName, *, json: _Json = False) -> None:
    """Print the arguments that a service takes."""
    from rosz.introspect.arguments import list_arguments
    from rosz.introspect.services import find_server

    call = call_of(context)
    token = find_server(call.survey().view, call.resolve(service, _TOOL))
    names = list_arguments(call.types.service(token.type_name).Request)
    if json:
        print_json({"args": names.split()})
    else:
        print_lines([names])


@app.command("node")
def node_command(context: Context, service: _ServiceName, *, json: _Json = False) -> None:
    """Print the node that serves a service."""
    from rosz.introspect.services import find_server

    call = call_of(context)
    token = find_server(call.survey().view, call.resolve(service, _TOOL))
    _print_one("node", token.node_name, as_json=json)


@app.command("uri")
def uri_command(context: Context, service: _ServiceName, *, json: _Json = False) -> None:
    """Print the key that a service is called by on Zenoh."""
    from rosz.introspect.services import find_server, service_key

    call = call_of(context)
    token = find_server(call.survey().view, call.resolve(service, _TOOL))
    _print_one("uri", service_key(token), as_json=json)


@app.command("call", arrange=values_last(frozenset({"--timeout"})))
def call_command(
    context: Context,
    service: _ServiceName,
    values: Annotated[
        list[str] | None,
        Argument(metavar="[VALUE]...", help="YAML: one dictionary, or a value per field."),
    ] = None,
    *,
    verbose: Annotated[bool, Option("-v", help="Print the request too.")] = False,
    wait: Annotated[bool, Option("--wait", help="Wait for the service.")] = False,
    timeout: Annotated[
        float, Option(metavar="SECONDS", help="Wait for the answer at most so long.")
    ] = 3600.0,
    json: _Json = False,
) -> None:
    """Call a service and print its answer."""
    from rosz.cli.service_call import CallOptions, call_service

    options = CallOptions(
        verbose=verbose, wait=wait, timeout=seconds("--timeout", timeout), as_json=json
    )
    call_service(call_of(context), service, values or (), options)
