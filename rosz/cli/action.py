"""``rosz action``: list actions, and send goals to them."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated, Any

from rosz.cli import suggest
from rosz.cli.call import Call, new_group
from rosz.cli.console import print_json_line, print_lines, print_result, until_stopped
from rosz.cli.declare import Argument, Json, Option, seconds, values_last
from rosz.errors import GoalFailed

if TYPE_CHECKING:
    from rosz.actions import ActionClient, GoalState

app = new_group("List actions, and send goals to them.")

_CANCEL_TIMEOUT = 10.0
_LATE_SECONDS = 0.2
"""The wait for feedback that the result has overtaken."""
_ActionName = Annotated[str, Argument("ACTION", source=suggest.actions)]


@app.command("list")
def list_command(
    call: Call,
    *,
    types: Annotated[bool, Option("-t --types", "Print the types as well.")] = False,
    json: Json = False,
) -> int:
    """List actions."""
    from rosz.actions import list_actions

    entries = list_actions(call.survey().view)
    lines = (entry.name + (f" [{', '.join(entry.types)}]" if types else "") for entry in entries)
    print_result(lines, entries, as_json=json)
    return int(call.incomplete)


@app.command("info")
def info_command(call: Call, action: _ActionName, *, json: Json = False) -> None:
    """Print the type, the servers and the clients of an action."""
    from rosz.actions import describe_action

    entry = describe_action(call.survey().view, call.resolve(action))
    lines = [f"Action: {entry.name}", f"Type: {', '.join(entry.types)}"]
    for title, nodes in (("servers", entry.servers), ("clients", entry.clients)):
        lines += [f"Action {title}: {len(nodes)}", *(f"    {node}" for node in nodes)]
    print_result(lines, entry, as_json=json)


@app.command("type")
def type_command(call: Call, action: _ActionName, *, json: Json = False) -> None:
    """Print the type of an action."""
    from rosz.actions import describe_action

    entry = describe_action(call.survey().view, call.resolve(action))
    print_result(entry.types, {"type": entry.types[0]}, as_json=json)


@app.command("show")
def show_command(
    call: Call,
    name: Annotated[str, Argument("TYPE", "PACKAGE/NAME, or NAME alone.", suggest.definitions)],
    *,
    raw: Annotated[bool, Option("-r --raw", "Print it as written, with comments.")] = False,
) -> None:
    """Print an action type: goal, result and feedback, with the fields of the types in them."""
    from rosz.introspect import Definitions

    definitions = Definitions(call.types, "action")
    for type_name in definitions.find(name):
        if "/" not in name:
            print_lines([f"[{type_name}]:"])
        print_lines([definitions.text(type_name) if raw else definitions.show(type_name)])


@app.command("send", arrange=values_last("--timeout"))
def send_command(
    call: Call,
    action: _ActionName,
    values: Annotated[
        list[str] | None,
        Argument(
            "VALUE",
            "The goal in YAML: one dictionary, or one value per field; defaults if omitted.",
            suggest.goal_values,
        ),
    ] = None,
    *,
    feedback: Annotated[bool, Option("-f --feedback", "Print feedback as it comes.")] = False,
    wait: Annotated[bool, Option("--wait", "Wait for a server of the action.")] = False,
    timeout: Annotated[float, Option("--timeout SECONDS", "Time limit for the result.")] = 86400.0,
    json: Json = False,
) -> int:
    """Send a goal and print its result; Ctrl-C cancels the goal.

    The exit code is 0 if the goal succeeded.
    """
    seconds("--timeout", timeout)
    from rosz.actions import GoalState, action_type, view_of_action, wait_for_action
    from rosz.introspect import listing_arguments, make_message, read_arguments
    from rosz.message import to_jsonable  # noqa: F401  # used later; Ctrl-C must not interrupt an import
    from rosz.node import Node

    arguments = read_arguments(values or ())
    state = GoalState.UNKNOWN
    with until_stopped() as ready, call.context(lasting=True) as context:
        ready()
        name = call.resolve(action)
        view = wait_for_action(context, name, timeout) if wait else view_of_action(context, name)
        with Node("rosz_action", anonymous=True, context=context) as node:
            kind = action_type(node, view, name)
            with node.action_client(name, kind) as client:
                with listing_arguments(kind.Goal):
                    goal = make_message(kind.Goal, arguments, time.time_ns())
                state = _send(client, goal, timeout, feedback=feedback, as_json=json)
    return int(state is not GoalState.SUCCEEDED)


def _printer(as_json: bool) -> Any:
    from rosz.message import to_jsonable

    def show(message: Any) -> None:
        if as_json:
            print_json_line({"feedback": to_jsonable(message)})
        else:
            print_lines(["feedback:", _indented(message), "---"])

    return show


def _send(
    client: ActionClient, goal: Any, timeout: float, *, feedback: bool, as_json: bool
) -> GoalState:
    """Send a goal, wait for its end, and print its result; return the final state."""
    from rosz.message import to_jsonable

    try:
        sent = client.send(goal, feedback=_printer(as_json) if feedback else None)
        if not as_json:
            print_lines([f"goal {sent.id} accepted"])
        sent.wait(timeout)
    except KeyboardInterrupt:
        if not client.goals:
            raise
        sent = client.goals[0]
        print_lines([] if as_json else ["canceling the goal"])
        sent.cancel()
        sent.wait(_CANCEL_TIMEOUT)
    if feedback:
        time.sleep(_LATE_SECONDS)
    try:
        result = sent.result(0)
    except GoalFailed as error:
        result = error.result
    lines = ["result:", _indented(result), f"goal {sent.status.text}"]
    row = {"status": sent.status.text, "result": to_jsonable(result)}
    print_result(lines, row, as_json=as_json)
    return sent.status


def _indented(message: Any) -> str:
    return "".join(f"  {line}\n" for line in str(message).splitlines()).rstrip("\n")
