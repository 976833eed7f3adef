"""``rosz node``: what rosnode does."""

from __future__ import annotations

import sys
from typing import Annotated

from rosz.cli.bounds import at_least
from rosz.cli.declare import Argument, Context, Option
from rosz.cli.group import call_of, new_group, print_json, print_lines, until_stopped
from rosz.errors import UsageError

__all__ = ("app",)

app = new_group("List, inspect, ping and end nodes.")

_TOOL = "rosnode"
_Json = Annotated[bool, Option("--json", help="As JSON.")]


@app.command("list")
def list_command(
    context: Context,
    namespace: Annotated[str, Argument(metavar="[NAMESPACE]")] = "",
    *,
    everything: Annotated[bool, Option("-a", "--all", help="With where they are.")] = False,
    places: Annotated[bool, Option("-u", help="Only where they are.")] = False,
    json: _Json = False,
) -> None:
    """List nodes."""
    from rosz.introspect.nodes import list_nodes
    from rosz.introspect.topics import in_namespace

    call = call_of(context)
    space = call.resolve(namespace, _TOOL) if namespace else "/"
    survey = call.survey(processes=everything or places or json)
    nodes = [node for node in list_nodes(survey) if in_namespace(node.name, space)]
    if json:
        print_json(nodes)
    elif everything:
        print_lines(f"{node.address} \t{node.name}" for node in nodes)
    else:
        print_lines(node.address if places else node.name for node in nodes)


@app.command("info")
def info_command(
    context: Context,
    nodes: Annotated[list[str], Argument(metavar="NODE...")],
    *,
    quiet: Annotated[
        bool, Option("-q", "--quiet", help="Do not ask the nodes themselves.")
    ] = False,
    json: _Json = False,
) -> None:
    """Tell what nodes publish, subscribe to and serve, and whom they are connected with."""
    from rosz.cli.node_talk import info

    info(call_of(context), nodes, quiet=quiet, as_json=json)


@app.command("machine")
def machine_command(
    context: Context,
    machine: Annotated[str, Argument(metavar="[MACHINE]")] = "",
    *,
    json: _Json = False,
) -> None:
    """List the machines that nodes run on, or the nodes on one of them."""
    from rosz.introspect.nodes import list_nodes, machines, nodes_on_machine

    nodes = list_nodes(call_of(context).survey(processes=True))
    found = nodes_on_machine(nodes, machine) if machine else machines(nodes)
    if json:
        print_json(found)
    else:
        print_lines(found)


@app.command("ping")
def ping_command(
    context: Context,
    node: Annotated[str, Argument(metavar="NODE")] = "",
    *,
    everybody: Annotated[bool, Option("-a", "--all", help="Ping all nodes once.")] = False,
    count: Annotated[
        int | None, Option("-c", metavar="COUNT", help="Ping so often; for ever otherwise.")
    ] = None,
) -> int:
    """Tell how long a node takes to answer; exit code 1 if it does not."""
    if everybody and (node or count is not None):
        raise UsageError("--all pings every node once: it takes no node and no -c")
    if count is not None:
        at_least("-c", count, 1, "pings")
    from rosz.cli.node_talk import ping, ping_all

    call = call_of(context)
    if everybody:
        return ping_all(call)
    if not node:
        names = call.survey().view.nodes()
        there = "there are:\n" + "\n".join(names) if names else "none is running"
        raise UsageError(f"no node is given; {there}")
    with until_stopped() as ready:
        ready()
        return ping(call, node, count)
    return 0


@app.command("kill")
def kill_command(
    context: Context,
    nodes: Annotated[list[str] | None, Argument(metavar="[NODE]...")] = None,
    *,
    everybody: Annotated[bool, Option("-a", "--all", help="End all nodes.")] = False,
) -> int:
    """Have nodes end, and wait until they are gone."""
    if everybody and nodes:
        raise UsageError("--all ends every node: it takes no names")
    from rosz.cli.node_talk import choose, kill

    call = call_of(context)
    if not everybody and not nodes:
        nodes = choose(call, sys.stdin)
        if not nodes:
            return 0
    return kill(call, nodes or (), everybody=everybody)


@app.command("cleanup")
def cleanup_command() -> None:
    """Forget nodes that are dead: there is nothing to do, since nobody keeps them."""
    print_lines(
        ["a node that is dead is gone from all lists at once: there is nothing to clean up"]
    )
