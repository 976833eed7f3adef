"""``rosz node info``, ``ping`` and ``kill``: what asks the nodes themselves."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TextIO

from rosz.cli.group import Call, print_json, print_lines
from rosz.errors import NotFoundError, RoszError, near_miss
from rosz.introspect import nodes as library
from rosz.introspect.nodes import PING_TIMEOUT, find_nodes, format_connections, format_node
from rosz.introspect.survey import Survey, take_survey
from rosz.names import short_type
from rosz.wire import Kind

if TYPE_CHECKING:
    from rosz.session import Session
    from rosz.wire import Token

__all__ = ("choose", "info", "kill", "ping", "ping_all")

_TOOL = "rosnode"
_PING_PERIOD = 1.0
_REASON = "user request"


def info(call: Call, names: Sequence[str], *, quiet: bool, as_json: bool) -> None:
    """Tell about nodes.

    Args:
        call: The call of the command.
        names: Of the nodes.
        quiet: Do not ask them.
        as_json: As JSON.
    """
    rows: list[dict[str, Any]] = []
    with call.session() as session:
        survey = take_survey(session, call.domain, processes=True)
        chosen = [node for name in names for node in find_nodes(survey, call.resolve(name, _TOOL))]
        for node in chosen:
            if as_json:
                rows.append(_row(session, survey, node, quiet=quiet))
                continue
            print_lines([format_node(survey, node)])
            if not quiet:
                print_lines([f"\ncontacting node {survey.address(node)} ..."])
                print_lines([_answers(session, node) + format_connections(survey, node)])
    if as_json:
        print_json(rows)


def _answers(session: Session, node: Token) -> str:
    try:
        answer = library.get_info(session, node)
    except NotFoundError as error:
        return f"{error}\n"
    return f"Pid: {answer.pid}\nCommand: {' '.join(answer.argv)}\n"


def _row(session: Session, survey: Survey, node: Token, *, quiet: bool) -> dict[str, Any]:
    ends: dict[str, list[dict[str, str]]] = {}
    kinds = {
        Kind.PUBLISHER: "publications",
        Kind.SUBSCRIPTION: "subscriptions",
        Kind.SERVICE: "services",
        Kind.CLIENT: "clients",
    }
    for kind, title in kinds.items():
        ends[title] = [
            {"name": token.name, "type": short_type(token.type_name), "hash": token.type_hash}
            for token in survey.view.entities(kind)
            if (token.zid, token.node_id) == (node.zid, node.node_id)
        ]
    row: dict[str, Any] = {"name": node.node_name, "session": node.zid, **ends}
    process = survey.process(node)
    if process is not None:
        row |= {"host": process.host, "pid": process.pid, "started": process.started}
    if process is not None and not quiet:
        row["argv"] = library.get_info(session, node).argv
    return row


def ping(call: Call, name: str, count: int | None) -> int:
    """Ask a node for a sign of life, again and again, and return the exit code.

    Args:
        call: The call of the command.
        name: Of the node.
        count: How often; for ever when not given.
    """
    full = call.resolve(name, _TOOL)
    print_lines([f"rosnode: node is [{full}]"])
    times: list[float] = []
    with call.session() as session:
        survey = take_survey(session, call.domain, processes=True)
        node = find_nodes(survey, full)[-1]
        print_lines([f"pinging {full} with a timeout of {PING_TIMEOUT}s"])
        try:
            while True:
                times.append(_ping(session, survey, node))
                if count is not None and len(times) >= count:
                    break
                time.sleep(_PING_PERIOD)
        finally:
            if len(times) > 1:
                print_lines([f"ping average: {sum(times) / len(times):f}ms"])
    return 0


def _ping(session: Session, survey: Survey, node: Token) -> float:
    """Ping a node, print its reply, and return how many milliseconds it took."""
    taken = library.ping(session, node) * 1e3
    print_lines([f"reply from {survey.address(node)}\ttime={taken:f}ms"])
    return taken


def ping_all(call: Call) -> int:
    """Ping every node once, and return the exit code."""
    with call.session() as session:
        survey = take_survey(session, call.domain, processes=True)
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
                    sys.stderr.write(f"cannot ping [{name}]: {error}\n")
    return code


def choose(call: Call, source: TextIO) -> list[str]:
    """Have a person choose a node from a list; return none if there is none."""
    names = sorted(set(call.survey().view.nodes()))
    if not names:
        sys.stderr.write("No nodes running\n")
        return []
    print_lines(f"{number}. {name}" for number, name in enumerate(names, 1))
    sys.stdout.write("\nPlease enter the number of the node you wish to kill.\n> ")
    sys.stdout.flush()
    for line in source:
        answer = line.strip()
        if answer.isdecimal() and 1 <= int(answer) <= len(names):
            return [names[int(answer) - 1]]
        print_lines([f"'{answer}' is none of them; please enter a number from 1 to {len(names)}"])
    return []


def kill(call: Call, names: Sequence[str], *, everybody: bool) -> int:
    """Have nodes end, and return the exit code.

    Args:
        call: The call of the command.
        names: Of the nodes.
        everybody: All of them, whatever the names.

    Raises:
        NotFoundError: There is no such node; then none is ended.
    """
    with call.session() as session:
        survey = take_survey(session, call.domain, processes=True)
        known = sorted(set(survey.view.nodes()))
        chosen = known if everybody else [call.resolve(name, _TOOL) for name in names]
        unknown = [name for name in chosen if name not in known]
        if unknown:
            listing = ", ".join(f"'{name}'{near_miss(name, known)}" for name in unknown)
            raise NotFoundError(f"unknown node(s): {listing}")
        if not chosen:
            sys.stderr.write("No nodes running\n")
            return 0
        print_lines(
            ["killing:", *(f" * {name}" for name in chosen)]
            if len(chosen) > 1
            else [f"killing {chosen[0]}"]
        )
        failed = library.kill_nodes(session, survey, chosen, _REASON)
    if failed:
        lines = [f" * {name}: {error}" for name, error in failed]
        sys.stderr.write("\n".join(["ERROR: Failed to kill:", *lines, ""]))
        return 1
    print_lines(["killed"])
    return 0
