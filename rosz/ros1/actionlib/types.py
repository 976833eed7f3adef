"""The classes of an action, and when a goal is over."""

from __future__ import annotations

from typing import Any

import msgspec

from rosz.errors import UsageError
from rosz.msgs.actionlib_msgs.msg import GoalStatus

__all__ = ("TERMINAL", "ActionTypes", "seconds_of")

TERMINAL = frozenset({
    GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.REJECTED,
    GoalStatus.RECALLED, GoalStatus.LOST,
})  # fmt: skip
"""States that a goal never leaves."""


class ActionTypes(msgspec.Struct, frozen=True):
    """Classes of the messages of an action.

    Attributes:
        action_goal: What carries a goal.
        action_result: What carries a result.
        action_feedback: What carries feedback.
        result: The result itself.
    """

    action_goal: type[Any]
    action_result: type[Any]
    action_feedback: type[Any]
    result: type[Any]

    @classmethod
    def of(cls, spec: type[Any]) -> ActionTypes:
        """Return the classes of an action.

        Args:
            spec: Its class, ``DoAction``.

        Raises:
            UsageError: It is no such class.
        """
        whole = spec()
        try:
            goal, result, feedback = (
                whole.action_goal, whole.action_result, whole.action_feedback
            )  # fmt: skip
            return cls(type(goal), type(result), type(feedback), type(result.result))
        except AttributeError as error:
            raise UsageError(
                f"{spec.__name__} is no action; expected a class such as FibonacciAction"
            ) from error


def seconds_of(duration: Any) -> float:
    """Return a duration, or a number of seconds, as seconds; 0 for None."""
    if duration is None:
        return 0.0
    return float(duration.to_sec()) if hasattr(duration, "to_sec") else float(duration)
