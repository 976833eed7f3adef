"""Calls of services, and goals of actions."""

from __future__ import annotations

import sys
import threading
import time
from argparse import Namespace
from typing import TYPE_CHECKING, Any

from rosz.cli.console import print_lines
from rosz.cli.ros2.graph import CommandFailed, open_node
from rosz.errors import GoalFailed, GoalRejected, RoszError, TypeNotFound
from rosz.ros2.rosidl_runtime_py import FILL_ERRORS, fill, to_repr, to_yaml

if TYPE_CHECKING:
    from rosz.node import Client

_FOREVER = threading.TIMEOUT_MAX / 2
_AT_ONCE = 1.0
_CANCEL_SECONDS = 10.0
_LATE_SECONDS = 0.2
"""The wait for feedback that the result has overtaken."""


def read_values(text: str) -> Any:
    """Return the values of a message that are given on a command line.

    Raises:
        CommandFailed: The text is not YAML.
    """
    import yaml

    try:
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise CommandFailed(f"the values are not YAML: {' '.join(str(error).split())}") from error


def _values(given: Namespace) -> Any:
    return read_values(sys.stdin.read() if given.stdin else given.values)


def call(given: Namespace) -> str | None:
    """Call a service."""
    if given.rate is not None and given.rate <= 0:
        raise CommandFailed("rate must be greater than zero")
    with open_node(lasting=given.rate is not None) as node:
        try:
            kind = node.context.types.service(given.type)
        except TypeNotFound as error:
            is_message = "/msg/" in given.type
            what = "type is not a service" if is_message else "service type is invalid"
            raise CommandFailed(f"The passed {what}") from error
        request = kind.Request()
        try:
            fill(request, _values(given))
        except FILL_ERRORS as error:
            return f"Failed to populate field: {error}"
        with node.client(given.name, kind, timeout=_FOREVER) as client:
            _await_server(client, "waiting for service to become available...")
            while True:
                print_lines([f"requester: making request: {to_repr(request)}\n"])
                due = time.monotonic() + (1 / given.rate if given.rate else 0)
                try:
                    response = client.call(request)
                except RoszError as error:
                    raise CommandFailed(f"Exception while calling service: {error!r}") from error
                print_lines([f"response:\n{to_repr(response)}\n"])
                if given.rate is None:
                    return None
                node.context.wait_for_shutdown(max(0.0, due - time.monotonic()))


def _await_server(client: Client, text: str) -> None:
    """Wait for a server; print a text if there is none."""
    view = client.others.refresh(_AT_ONCE)
    if not any(map(client.matches, view.servers(client.name))):
        print_lines([text])
        client.wait_for_service(_FOREVER)


def send_goal(given: Namespace) -> str | None:
    """Send a goal, and print its result; Ctrl-C cancels the goal."""
    with open_node(lasting=True) as node:
        try:
            kind = node.context.types.action(given.type)
        except TypeNotFound as error:
            raise CommandFailed("The passed action type is invalid") from error
        goal = kind.Goal()
        try:
            fill(goal, _values(given))
        except FILL_ERRORS as error:
            return f"Failed to populate message fields: {error!r}"
        client = node.action_client(given.name, kind)
        print_lines(["Waiting for an action server to become available..."])
        client.wait_for_server(_FOREVER)
        print_lines([f"Sending goal:\n     {to_yaml(goal)}"])
        try:
            _follow(client, goal, feedback=given.feedback)
        except KeyboardInterrupt:
            if client.goals:
                _cancel(client.goals[0])
            raise
    return None


def _follow(client: Any, goal: Any, *, feedback: bool) -> None:
    try:
        sent = client.send(goal)
    except GoalRejected:
        print_lines(["Goal was rejected."])
        return
    print_lines([f"Goal accepted with ID: {sent.id.hex}\n"])
    for late in (0.0, _LATE_SECONDS) if feedback else ():
        time.sleep(late)
        for part in sent:
            print_lines([f"Feedback:\n    {to_yaml(part)}"])
    try:
        result = sent.result()
    except GoalFailed as error:
        result = error.result
    print_lines([f"Result:\n    {to_yaml(result)}"])
    print_lines([f"Goal finished with status: {sent.status.name}"])


def _cancel(goal: Any) -> None:
    print_lines(["Canceling goal..."])
    try:
        accepted = goal.cancel(_CANCEL_SECONDS)
    except RoszError as error:
        raise CommandFailed(f"Exception while canceling goal: {error!r}") from error
    if not accepted:
        raise CommandFailed("Failed to cancel goal")
    print_lines(["Goal canceled."])
