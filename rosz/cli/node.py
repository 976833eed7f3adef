"""``rosz node``: the commands of rosnode."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Annotated, Any

from rosz.cli import suggest
from rosz.cli.call import Call, new_group
from rosz.cli.console import print_error, print_json, print_lines, print_result, until_stopped
from rosz.cli.declare import Argument, Json, Option, at_least
from rosz.errors import NotFoundError, RoszError, UsageError, near_miss
from rosz.names import ros1_type

if TYPE_CHECKING:
    from rosz.introspect import Survey
    from rosz.session import Session
    from rosz.wire import Token

app = new_group("List, inspect, ping and kill nodes.")

_TOOL = "rosnode"
_PING_PERIOD = 1.0
_REASON = "user request"


@app.command("list")
def list_command(
    call: Call,
    namespace: Annotated[str, Argument("NAMESPACE", "Lists all if omitted.", suggest.nodes)] = "",
    *,
    everything: Annotated[bool, Option("-a --all", "Print where each node runs as well.")] = False,
    places: Annotated[bool, Option("-u", "Print only where each node runs.")] = False,
    json: Json = False,
) -> int:
    """List nodes."""
    from rosz.introspect import in_namespace, list_nodes

    space = call.resolve(namespace, _TOOL) if namespace else "/"
    survey = call.survey(processes=everything or places or json)
    nodes = [node for node in list_nodes(survey) if in_namespace(node.name, space)]
    if everything:
        lines = [f"{node.address} \t{node.name}" for node in nodes]
    else:
        lines = [node.address if places else node.name for node in nodes]
    print_result(lines, nodes, as_json=json)
    return int(call.incomplete)


@app.command("info")
def info_command(
    call: Call,
    nodes: Annotated[list[str], Argument("NODE", source=suggest.nodes)],
    *,
    quiet: Annotated[bool, Option("-q --quiet", "Do not send requests to the nodes.")] = False,
    json: Json = False,
) -> None:
    """Print the topics, services and connections of nodes."""
    from rosz.introspect import find_nodes, format_connections, format_node

    rows: list[dict[str, Any]] = []
    names = [call.resolve(name, _TOOL) for name in nodes]
    with call.session_and_survey(names) as (session, survey):
        chosen = [node for name in names for node in find_nodes(survey, name)]
        for node in chosen:
            if json:
                rows.append(_info_row(session, survey, node, quiet=quiet))
                continue
            print_lines([format_node(survey, node)])
            if not quiet:
                print_lines([f"\ncontacting node {survey.address(node)} ..."])
                print_lines([_process_text(session, node) + format_connections(survey, node)])
    if json:
        print_json(rows)


def _process_text(session: Session, node: Token) -> str:
    from rosz.introspect import get_info

    try:
        info = get_info(session, node)
    except NotFoundError as error:
        return f"{error}\n"
    return f"Pid: {info.pid}\nCommand: {' '.join(info.argv)}\n"


def _info_row(session: Session, survey: Survey, node: Token, *, quiet: bool) -> dict[str, Any]:
    from rosz.introspect import get_info
    from rosz.wire import Kind

    row: dict[str, Any] = {"name": node.node_name, "session": node.zid}
    kinds = {
        Kind.PUBLISHER: "publications",
        Kind.SUBSCRIPTION: "subscriptions",
        Kind.SERVICE: "services",
        Kind.CLIENT: "clients",
    }
    for kind, title in kinds.items():
        row[title] = [
            {
                "name": token.name,
                "type": ros1_type(token.name, token.type_name),
                "hash": token.type_hash,
            }
            for token in survey.view.entities(kind)
            if (token.zid, token.node_id) == (node.zid, node.node_id)
        ]
    process = survey.process(node)
    if process is not None:
        row |= {"host": process.host, "pid": process.pid, "started": process.started}
        if not quiet:
            row["argv"] = get_info(session, node).argv
    return row


@app.command("machine")
def machine_command(
    call: Call,
    machine: Annotated[str, Argument("MACHINE", "Lists all if omitted.", suggest.machines)] = "",
    *,
    json: Json = False,
) -> None:
    """List the machines that nodes run on, or the nodes on one machine."""
    from rosz.introspect import list_nodes, machines, nodes_on_machine

    nodes = list_nodes(call.survey(processes=True))
    listing = nodes_on_machine(nodes, machine) if machine else machines(nodes)
    print_result(listing, listing, as_json=json)


@app.command("ping")
def ping_command(
    call: Call,
    node: Annotated[str, Argument("NODE", source=suggest.nodes)] = "",
    *,
    everybody: Annotated[bool, Option("-a --all", "Ping all nodes once.")] = False,
    count: Annotated[
        int | None, Option("-c COUNT", "Number of pings; without it, ping until stopped.")
    ] = None,
) -> int:
    """Print how long a node takes to reply; exit code 1 if it does not reply."""
    if everybody and (node or count is not None):
        raise UsageError("--all pings every node once: it takes no node and no -c")
    at_least("-c", count, 1, "pings")
    if everybody:
        return _ping_all(call)
    if not node:
        names = call.survey().view.nodes()
        running = "there are:\n" + "\n".join(names) if names else "none is running"
        raise UsageError(f"no node is given; {running}")
    _ping_often(call, node, count)
    return 0


def _ping_often(call: Call, name: str, count: int | None) -> None:
    from rosz.introspect import PING_TIMEOUT, find_nodes

    full = call.resolve(name, _TOOL)
    print_lines([f"rosnode: node is [{full}]"])
    times: list[float] = []
    with until_stopped() as ready, call.session_and_survey([full]) as (session, survey):
        ready()
        node = find_nodes(survey, full)[-1]
        print_lines([f"pinging {full} with a timeout of {PING_TIMEOUT}s"])
        try:
            while True:
                times.append(_ping(session, survey, node))
                if count is not None and len(times) >= count:
                    return
                time.sleep(_PING_PERIOD)
        finally:
            if len(times) > 1:
                print_lines([f"ping average: {sum(times) / len(times):f}ms"])


def _ping(session: Session, survey: Survey, node: Token) -> float:
    """Ping a node, print its reply, and return how many milliseconds it took."""
    from rosz.introspect import ping

    taken = ping(session, node) * 1e3
    print_lines([f"reply from {survey.address(node)}\ttime={taken:f}ms"])
    return taken


def _ping_all(call: Call) -> int:
    from rosz.introspect import PING_TIMEOUT

    with call.session_and_survey() as (session, survey):
        names = sorted(set(survey.view.nodes()))
        print_lines(["Will ping the following nodes: ", *(f" * {name}" for name in names), ""])
        code = 0
        for name in names:
            print_lines([f"pinging {name} with a timeout of {PING_TIMEOUT}s"])
            for node in survey.nodes_named(name):
                try:
                    _ping(session, survey, node)
                except RoszError as error:
                    code = 1
                    print_error(f"cannot ping [{name}]: {error}")
    return code


@app.command("kill")
def kill_command(
    call: Call,
    nodes: Annotated[list[str] | None, Argument("NODE", "Asks if omitted.", suggest.nodes)] = None,
    *,
    everybody: Annotated[bool, Option("-a --all", "Kill all nodes.")] = False,
) -> int:
    """Shut nodes down, and wait until they have ended."""
    if everybody and nodes:
        raise UsageError("--all ends every node: it takes no names")
    if not everybody and not nodes:
        nodes = _choose(call)
        if not nodes:
            return 0
    wanted = [call.resolve(name, _TOOL) for name in nodes or ()]
    with call.session_and_survey(wanted) as (session, survey):
        running = sorted(set(survey.view.nodes()))
        unknown = [name for name in wanted if name not in running]
        if unknown:
            listing = ", ".join(f"'{name}'{near_miss(name, running)}" for name in unknown)
            raise NotFoundError(f"unknown node(s): {listing}")
        return _kill(session, survey, running if everybody else wanted)


def _kill(session: Session, survey: Survey, chosen: list[str]) -> int:
    """Shut nodes down, report how it went, and return the exit code."""
    from rosz.introspect import kill_nodes

    if not chosen:
        print_error("No nodes running")
        return 0
    several = ["killing:", *(f" * {name}" for name in chosen)]
    print_lines(several if len(chosen) > 1 else [f"killing {chosen[0]}"])
    failed = kill_nodes(session, survey, chosen, _REASON)
    if failed:
        lines = [f" * {name}: {error}" for name, error in failed]
        print_error("\n".join(["ERROR: Failed to kill:", *lines]))
        return 1
    print_lines(["killed"])
    return 0


def _choose(call: Call) -> list[str]:
    """Ask which node to kill; return no name if no node runs or nothing is chosen."""
    names = sorted(set(call.survey().view.nodes()))
    if not names:
        print_error("No nodes running")
        return []
    print_lines(f"{number}. {name}" for number, name in enumerate(names, 1))
    sys.stdout.write("\nPlease enter the number of the node you wish to kill.\n> ")
    sys.stdout.flush()
    for line in sys.stdin:
        answer = line.strip()
        if answer.isdecimal() and 1 <= int(answer) <= len(names):
            return [names[int(answer) - 1]]
        print_lines([f"'{answer}' is not one of them; enter a number from 1 to {len(names)}"])
    return []


@app.command("cleanup")
def cleanup_command() -> None:
    """Do nothing: dead nodes are not kept anywhere, so there is nothing to clean up."""
    print_lines(["a dead node is gone from all lists at once: there is nothing to clean up"])
