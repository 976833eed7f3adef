"""launch.events and launch.event_handlers: what waits for a time, or for a start or end.

What a handler executes is in the plan from the beginning, with the event that it waits for.
"""

from __future__ import annotations

from typing import Any

from rosz.launch.plan import StepPlan, Trigger
from rosz.ros2.launch.base import (
    LaunchContext,
    Part,
    SubstitutionFailure,
    make,
    refusing,
    visit_all,
)


def handle(context: LaunchContext, event: Any, process: Any, actions: Any) -> None:
    """Let actions wait for the start or exit of a process, or of any if it is None."""
    if callable(actions) or not (process is None or hasattr(process, "plan")):
        raise SubstitutionFailure("rosz takes actions and processes here, and no functions")
    context.handlers.append((context.place, event, process, actions))


def execute_handlers(context: LaunchContext) -> None:
    """Execute the actions that wait for events of processes in the plan."""
    ready: list[Any] = [True]
    while ready:
        ready = [each for each in context.handlers if each[2] is None or each[2].plan]
        context.handlers = [each for each in context.handlers if each not in ready]
        for place, event, process, actions in ready:
            context.timing = Trigger(event, process.plan.full_name if process else ""), 0.0
            with refusing(place, place.includes):
                visit_all(context, actions)


def delay(context: LaunchContext, period: Any, actions: Any, **_: Any) -> None:
    """Let actions wait for a time in seconds."""
    before = context.timing
    seconds = period if isinstance(period, int | float) else float(context.text(period))
    context.timing = before[0], before[1] + seconds
    visit_all(context, actions)
    context.timing = before


def add_step(context: LaunchContext, msg: Any, *, shutdown: bool = False) -> None:
    """Print a text, and end the launch if wanted."""
    step = StepPlan(context.text(msg), context.place, shutdown, *context.timing)
    context.builder.steps.append(step)


def shut_down(context: LaunchContext, *, reason: Any = "", **_: Any) -> None:
    """End the launch."""
    add_step(context, reason, shutdown=True)


_HANDLERS: dict[str, Any] = {
    "OnProcessExit": lambda context, *, target_action=None, on_exit, **_: handle(
        context, "exit", target_action, on_exit
    ),
    "OnProcessStart": lambda context, *, target_action=None, on_start, **_: handle(
        context, "start", target_action, on_start
    ),
    "OnShutdown": lambda context, **_: context.warn(
        "what OnShutdown holds is left out: a launch executes nothing at its end"
    ),
    "Shutdown": shut_down,
}
globals().update(make(__name__, Part, _HANDLERS))
