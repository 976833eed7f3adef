"""``rosz log``: follow the log of all nodes, and set levels."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from queue import SimpleQueue
from typing import TYPE_CHECKING, Annotated

from rosz.cli import suggest
from rosz.cli.call import Call
from rosz.cli.console import paint, print_json_line, print_result, takes_escapes, warn
from rosz.cli.declare import App, Argument, Option, at_least
from rosz.errors import DecodeError, UsageError
from rosz.names import printable

if TYPE_CHECKING:
    from rosz.introspect import LogFilter
    from rosz.session import Sample

app = App()

_TOOL = "rosconsole"
_LEVEL_WORDS = 4
_LEVELS = ["debug", "info", "warn", "error", "fatal"]
_ROSOUT = "/rosout"


@app.command()
def log_command(
    call: Call,
    words: Annotated[
        list[str] | None,
        Argument(
            "NODE",
            "Nodes or namespaces to follow; all if omitted. 'level NODE LOGGER LEVEL' sets the"
            " level of a logger, 'levels NODE' lists the levels.",
            suggest.nodes,
        ),
    ] = None,
    *,
    level: Annotated[
        str, Option("--level -l LEVEL", "The lowest level to print.", lambda _: _LEVELS)
    ] = "DEBUG",
    grep: Annotated[str, Option("--grep PATTERN", "Print only messages with this pattern.")] = "",
    count: Annotated[int | None, Option("-n COUNT", "Stop after this number of messages.")] = None,
    verbose: Annotated[bool, Option("-v --verbose", "Print places in the source as well.")] = False,
    json: Annotated[bool, Option("--json", "Print one line of JSON per message.")] = False,
) -> None:
    """Follow the log of nodes, or set and list the levels of their loggers.

    The levels are DEBUG, INFO, WARN, ERROR and FATAL. The logger of the node itself is 'rosout'.
    """
    at_least("-n", count, 1, "lines")
    words = words or []
    if words[:1] == ["level"]:
        _set_level(call, words)
        return
    if words[:1] == ["levels"]:
        _list_levels(call, words[1:], as_json=json)
        return
    from rosz.introspect import LogFilter

    wanted = LogFilter([call.resolve(word, _TOOL) for word in words], level, grep)
    _follow(call, wanted, count, verbose=verbose, as_json=json)


def _set_level(call: Call, words: Sequence[str]) -> None:
    if len(words) != _LEVEL_WORDS:
        raise UsageError("expected: rosz log level NODE LOGGER LEVEL")
    from rosz.introspect import find_nodes, set_level
    from rosz.node import parse_severity

    _, node, logger, level = words
    parse_severity(level)
    name = call.resolve(node, _TOOL)
    with call.session_and_survey([name]) as (session, survey):
        for token in find_nodes(survey, name):
            set_level(session, token, logger, level)


def _list_levels(call: Call, nodes: Sequence[str], *, as_json: bool) -> None:
    from rosz.introspect import find_nodes, get_levels

    if not nodes:
        raise UsageError("expected: rosz log levels NODE")
    by_node: dict[str, dict[str, str]] = {}
    names = [call.resolve(node, _TOOL) for node in nodes]
    with call.session_and_survey(names) as (session, survey):
        for name in names:
            for token in find_nodes(survey, name):
                by_node[token.node_name] = get_levels(session, token)
    lines = (f"{logger} {level}" for levels in by_node.values() for logger, level in levels.items())
    print_result(lines, by_node, as_json=as_json)


def _follow(
    call: Call, wanted: LogFilter, count: int | None, *, verbose: bool, as_json: bool
) -> None:
    from rosz.introspect import format_line, read_line, subscribe_samples
    from rosz.msgs.rcl_interfaces.msg import Log

    color = takes_escapes(sys.stdout) and not os.environ.get("NO_COLOR")
    left = count or -1  # which is never 0 after a line
    with call.lasting_node(_TOOL) as node:
        queue: SimpleQueue[Sample | None] = SimpleQueue()
        subscribe_samples(node, _ROSOUT, Log._type_name, Log._type_hash, queue.put)
        node.on_shutdown(lambda _: queue.put(None))
        while (sample := queue.get()) is not None:
            try:
                line = read_line(Log.from_cdr(sample.payload), node.context.graph.view().nodes())
            except DecodeError as error:
                warn(f"a message on {_ROSOUT} is not a log message: {error}")
                continue
            if not wanted.accepts(line):
                continue
            if as_json:
                print_json_line(line)
            else:
                text = printable(format_line(line, verbose=verbose))
                sys.stdout.write(f"{paint(text, line.level.lower() if color else '')}\n")
                sys.stdout.flush()
            left -= 1
            if not left:
                return
