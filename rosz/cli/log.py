"""``rosz log``: follow the log of all nodes, and set levels."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from queue import SimpleQueue
from typing import TYPE_CHECKING, Annotated

from rosz.cli.bounds import at_least
from rosz.cli.declare import App, Argument, Option
from rosz.cli.group import (
    Call,
    print_json,
    print_lines,
    takes_escapes,
    until_stopped,
    warn,
)
from rosz.errors import UsageError

if TYPE_CHECKING:
    from rosz.introspect.rosout import LogFilter
    from rosz.msgs.rcl_interfaces.msg import Log
    from rosz.node import Node
    from rosz.session import Sample

__all__ = ("app",)

app = App()

_TOOL = "rosconsole"
_LEVEL_WORDS = 4
_ROSOUT = "/rosout"


@app.command()
def log_command(
    words: Annotated[
        list[str] | None,
        Argument(
            metavar="[NODE]... | level NODE LOGGER LEVEL | levels NODE",
            help="Nodes or namespaces to follow; all when none is given.",
        ),
    ] = None,
    *,
    level: Annotated[
        str, Option("--level", "-l", metavar="LEVEL", help="The least level to show.")
    ] = "DEBUG",
    grep: Annotated[
        str, Option("--grep", metavar="PATTERN", help="Only texts that hold this.")
    ] = "",
    count: Annotated[
        int | None, Option("-n", metavar="COUNT", help="End after so many lines.")
    ] = None,
    verbose: Annotated[bool, Option("-v", "--verbose", help="With places in the source.")] = False,
    json: Annotated[bool, Option("--json", help="As JSON, one line each.")] = False,
) -> None:
    """Follow what nodes log; 'level' sets the level of a logger, 'levels' lists them.

    The levels are DEBUG, INFO, WARN, ERROR and FATAL; the logger of a node itself is 'rosout'.
    """
    if count is not None:
        at_least("-n", count, 1, "lines")
    call = Call(())
    words = words or []
    if words[:1] == ["level"]:
        _set_level(call, words)
        return
    if words[:1] == ["levels"]:
        _list_levels(call, words[1:], as_json=json)
        return
    from rosz.introspect.rosout import LogFilter

    wanted = LogFilter([call.resolve(word, _TOOL) for word in words], level, grep)
    _follow(call, wanted, count, verbose=verbose, as_json=json)


def _set_level(call: Call, words: Sequence[str]) -> None:
    if len(words) != _LEVEL_WORDS:
        raise UsageError("expected: rosz log level NODE LOGGER LEVEL")
    from rosz.introspect.nodes import find_nodes, set_level
    from rosz.introspect.survey import take_survey
    from rosz.node.logger import parse_severity

    _, node, logger, level = words
    parse_severity(level)
    with call.session() as session:
        for token in find_nodes(take_survey(session, call.domain), call.resolve(node, _TOOL)):
            set_level(session, token, logger, level)


def _list_levels(call: Call, nodes: Sequence[str], *, as_json: bool) -> None:
    from rosz.introspect.nodes import find_nodes, get_levels
    from rosz.introspect.survey import take_survey

    if not nodes:
        raise UsageError("expected: rosz log levels NODE")
    found: dict[str, dict[str, str]] = {}
    with call.session() as session:
        survey = take_survey(session, call.domain)
        for node in nodes:
            for token in find_nodes(survey, call.resolve(node, _TOOL)):
                found[token.node_name] = get_levels(session, token)
    if as_json:
        print_json(found)
        return
    for levels in found.values():
        print_lines(f"{logger} {level}" for logger, level in levels.items())


def _follow(
    call: Call, wanted: LogFilter, count: int | None, *, verbose: bool, as_json: bool
) -> None:
    import msgspec

    from rosz.errors import DecodeError
    from rosz.introspect.rosout import format_line, read_line
    from rosz.msgs.rcl_interfaces.msg import Log
    from rosz.node import Node

    color = takes_escapes(sys.stdout) and not os.environ.get("NO_COLOR")
    left = count
    with (
        until_stopped() as ready,
        call.context(lasting=True) as context,
        Node(_TOOL, anonymous=True, context=context) as node,
    ):
        ready()
        for sample in _samples(node, Log):
            try:
                line = read_line(Log.from_cdr(sample.payload), context.graph.view().nodes())
            except DecodeError as error:
                warn(f"something on {_ROSOUT} is no line of a log: {error}")
                continue
            if not wanted.accepts(line):
                continue
            if as_json:
                print_lines([msgspec.json.encode(line).decode()])
            else:
                print_lines([format_line(line, color=color, verbose=verbose)])
            if left is not None:
                left -= 1
                if left <= 0:
                    return


def _samples(node: Node, log_type: type[Log]) -> Iterator[Sample]:
    """Yield what is published on ``/rosout`` from now on, until the node ends."""
    from rosz.introspect.subscribe import subscribe_samples

    queue: SimpleQueue[Sample | None] = SimpleQueue()
    subscribe_samples(node, _ROSOUT, log_type._type_name, log_type._type_hash, queue.put)
    node.on_shutdown(lambda _: queue.put(None))
    while (sample := queue.get()) is not None:
        yield sample
