"""What a launch says about itself: at the start what it will do, at the end what went wrong."""

from __future__ import annotations

import signal
from collections import defaultdict
from collections.abc import Iterable
from typing import Any

from rosz.launch.plan.model import NodePlan, Plan
from rosz.launch.run.process import Process, State

__all__ = ("fallen", "overview", "reason")

_WIDEST = 20


def overview(plan: Plan, *, machines: bool = False) -> str:
    """Return what a launch will do, as roslaunch prints it.

    Args:
        plan: The plan.
        machines: Whether to list machines, as is done when some are not this one.
    """
    parts = ["\nSUMMARY\n========"]
    if plan.clear:
        cleared = sorted(f" * {name.rstrip('/')}/" for name in plan.clear)
        parts.append("CLEAR PARAMETERS\n" + "\n".join(cleared))
    if plan.params:
        lines = sorted(f" * {param.name}: {_brief(param.value)}" for param in plan.params)
        parts.append("PARAMETERS\n" + "\n".join(lines))
    if machines:
        parts.append("MACHINES\n" + "\n".join(sorted(f" * {m.name}" for m in plan.machines)))
    parts.append("NODES\n" + "\n".join(_nodes(plan.nodes)))
    return "\n\n".join(parts) + "\n"


def _nodes(nodes: Iterable[NodePlan]) -> list[str]:
    spaces: defaultdict[str, list[str]] = defaultdict(list)
    for node in nodes:
        what = f"{node.package}/{node.type}" if node.package else " ".join(node.command)
        spaces[f"{node.namespace.rstrip('/')}/"].append(f"    {node.name} ({what})")
    return [line for space in sorted(spaces) for line in (f"  {space}", *sorted(spaces[space]))]


def _brief(value: Any) -> str:
    """Return a value in at most 20 characters, all of which can be printed."""
    text = str(value)
    if len(text) > _WIDEST:
        text = text[: _WIDEST - 3] + "..."
    stripped = text.rstrip()
    if all(" " <= char <= "~" for char in stripped):
        return stripped if stripped != text and not text.isprintable() else text
    return "<...>"


def fallen(processes: Iterable[Process]) -> str:
    """Return who died, why, and what each said last; empty when nobody did."""
    parts = []
    for process in processes:
        lines = [f" * {process.node.full_name} [{process.label}] {reason(process)}"]
        lines += [f"     {line}" for line in process.tail]
        parts.append("\n".join(lines))
    return "\n".join(["\nDIED", *parts]) if parts else ""


def reason(process: Process) -> str:
    """Return how a process ended."""
    if process.state is State.FAILED:
        return f"could not be started: {process.error}"
    text = exit_reason(process.code)
    if process.killed:
        text = "did not end when asked to, and was killed"
    respawns = process.starts - 1
    again = f", restarted {respawns} time{'s' * (respawns != 1)}" if respawns else ""
    return f"{text} after {process.ended - process.began:.1f} s{again}"


def exit_reason(code: int | None) -> str:
    """Return what an exit code means."""
    if code is None:
        return "gave no exit code"
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        return f"was ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"was ended by signal {-code}"
