"""The error that tells what does not hold, with all that led to it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NoReturn

from rosz.params.replica.core import effects as done

if TYPE_CHECKING:
    from .process import Process
    from .world import World


class Violation(AssertionError):
    """Something that must hold does not; the text has the trace of what led to it."""


def fail(world: World, process: Process, text: str) -> NoReturn:
    """Raise a `Violation`.

    Args:
        world: The world.
        process: The process whose core is wrong.
        text: What is wrong.
    """
    raise Violation(f"{process.zid} {text}\n{world.setting}\nseed {world.seed}\n{world.story()}")


def line_of(what: Any) -> str:
    """Return a line of a trace: what a process was told or did."""
    if isinstance(what, str):
        return f"-- {what}"
    head = "  =>" if isinstance(what, done.Effect) else "<="
    if isinstance(what, done.TreeChanged):
        return f"{head} TreeChanged({what.new})"
    return f"{head} {what!r:.200}"
