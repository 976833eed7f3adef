"""``rosz bridge``: programs that speak other protocols take part in the network."""

from __future__ import annotations

import time
from contextlib import ExitStack
from typing import Annotated

from rosz.cli.console import print_lines, until_stopped
from rosz.cli.core import open_master, read_master_place
from rosz.cli.declare import App, Option
from rosz.errors import UsageError

__all__ = ("app",)

app = App("Let programs that speak other protocols take part in the network.")

_LONG = 3600.0


@app.command("ros1")
def ros1_command(
    *,
    master: Annotated[
        str, Option("--master URI", "Join a roscore, such as http://robot:11311.")
    ] = "",
    namespace: Annotated[
        str, Option("--namespace NAME", "Namespace for all names of the roscore.")
    ] = "",
    topics: Annotated[
        list[str] | None,
        Option("--topics PATTERN", "Topics that cross, all by default; repeatable."),
    ] = None,
    services: Annotated[
        list[str] | None,
        Option("--services PATTERN", "Services that cross, all by default; repeatable."),
    ] = None,
    params: Annotated[
        list[str] | None,
        Option("--params PATTERN", "Parameters that cross, all by default; repeatable."),
    ] = None,
    port: Annotated[
        str, Option("-p --port PORT", "Without --master: port of the master, instead of 11311.")
    ] = "",
    address: Annotated[
        str, Option("--address ADDRESS", "Without --master: its address, instead of 127.0.0.1.")
    ] = "",
) -> None:
    """Join a roscore, or be the master of ROS 1's programs, until it is stopped."""
    place = read_master_place(port, address, wanted=not master)
    crossing = namespace or topics or services or params
    if place is not None and crossing:
        raise UsageError("--namespace, --topics, --services and --params need --master")
    if namespace and not namespace.startswith("/"):
        raise UsageError(f"--namespace is '{namespace}': expected a global name such as /robot1")
    from rosz.environment import Environment

    environment = Environment.read()
    with until_stopped() as ready, ExitStack() as stack:
        if place is not None:
            lines = open_master(environment, *place, stack)
        else:
            from rosz.bridges.ros1 import AttachedBridge, Choice

            choice = Choice(tuple(topics or ()), tuple(services or ()), tuple(params or ()))
            stack.enter_context(
                AttachedBridge(master, environment, choice=choice, namespace=namespace)
            )
            lines = [f"joining the roscore at {master}"]
        ready()
        print_lines([*lines, "started the bridge; press Ctrl-C to end it"])
        while True:
            time.sleep(_LONG)
