"""``rosz launch --status``, ``--restart`` and ``--stop``: talking to launches that run."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import msgspec

from rosz.environment import Environment
from rosz.errors import LaunchError, TransportError, UsageError
from rosz.introspect.connect import command_config
from rosz.launch.run import StatusClient
from rosz.session import Session

if TYPE_CHECKING:
    from rosz.launch.run import LaunchStatus, NodeStatus

__all__ = ("control",)

_SAMPLE_SECONDS = 0.4
"""Between the two looks at processor time that give a share."""


def control(words: Sequence[str], *, status: bool, restart: str, stop: str, as_json: bool) -> int:
    """Carry out one of the three, and return the exit code.

    Raises:
        UsageError: More than one of them, or a file as well.
        LaunchError: No launch is running, or it refuses.
        NotFoundError: No launch has such a node.
    """
    if words or (status, bool(restart), bool(stop)).count(True) > 1:
        raise UsageError("--status, --restart and --stop stand alone: one of them, and no file")
    environment = Environment.read()
    try:
        session = Session.open(command_config(environment))
    except TransportError as error:
        raise LaunchError(
            f"no launch is running: nobody answers at {environment.rendezvous}"
        ) from error
    with session:
        client = StatusClient(session, environment.domain)
        if restart:
            client.request("restart", restart)
        elif stop:
            client.request("stop", stop)
        else:
            _show(client, environment.domain, as_json=as_json)
    return 0


def _show(client: StatusClient, domain: int, *, as_json: bool) -> None:
    before = {(launch.host, launch.pid): launch for launch in client.statuses()}
    if not before:
        raise LaunchError(f"no launch is running in domain {domain}")
    if as_json:
        text = msgspec.json.format(msgspec.json.encode(list(before.values())))
        sys.stdout.write(f"{text.decode()}\n")
        return
    time.sleep(_SAMPLE_SECONDS)
    for launch in client.statuses():
        earlier = before.get((launch.host, launch.pid), launch)
        sys.stdout.write(table(launch, earlier))


def table(launch: LaunchStatus, before: LaunchStatus) -> str:
    """Return a launch as text, shares of processor time counted since an earlier look."""
    head = ("NODE", "STATE", "PID", "RESTARTS", "CPU", "MEMORY", "UPTIME", "MACHINE")
    earlier = {node.name: node.cpu for node in before.nodes}
    seconds = launch.sampled - before.sampled
    rows = [head, *(_row(node, earlier.get(node.name, node.cpu), seconds) for node in launch.nodes)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
    title = f"{', '.join(launch.files)} (launch {launch.pid} on {launch.host}, run {launch.run_id})"
    return "\n".join([title, *(f"  {line}" for line in lines), ""])


def _row(node: NodeStatus, cpu_before: float, seconds: float) -> tuple[str, ...]:
    share = f"{100 * max(0.0, node.cpu - cpu_before) / seconds:.0f} %" if seconds > 0 else "-"
    state = f"{node.state}: {node.detail}" if node.detail else node.state
    return (
        node.name,
        state,
        str(node.pid or "-"),
        str(node.restarts),
        share if node.pid else "-",
        f"{node.memory / 1e6:.0f} MB" if node.pid else "-",
        _duration(node.uptime) if node.pid else "-",
        node.machine or "-",
    )


def _duration(seconds: float) -> str:
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
