"""The message classes of an action, and the kinds of goal states."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec

from rosz.errors import ClosedError, UsageError
from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.node import Node

__all__ = ("RUNNING", "TERMINAL", "ActionTypes", "publish", "run_callback")

RUNNING = frozenset({GoalStatus.ACTIVE, GoalStatus.PREEMPTING})
"""States of a goal that the server is executing."""

TERMINAL = frozenset({
    GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.REJECTED,
    GoalStatus.RECALLED, GoalStatus.LOST,
})  # fmt: skip
"""States that a goal never leaves."""


class ActionTypes(msgspec.Struct, frozen=True):
    """The message classes of an action.

    Attributes:
        action_goal: Class of the messages on ``goal``.
        action_result: Class of the messages on ``result``.
        action_feedback: Class of the messages on ``feedback``.
        result: Class of the result itself.
    """

    action_goal: type[Any]
    action_result: type[Any]
    action_feedback: type[Any]
    result: type[Any]

    @classmethod
    def of(cls, action_type: type[Any]) -> ActionTypes:
        """Return the message classes of an action.

        Args:
            action_type: Class of the action, such as ``FibonacciAction``.

        Raises:
            UsageError: The class is not that of an action.
        """
        whole = action_type()
        try:
            goal, result = whole.action_goal, whole.action_result
            feedback = whole.action_feedback
            return cls(type(goal), type(result), type(feedback), type(result.result))
        except AttributeError as error:
            raise UsageError(
                f"{action_type.__name__} is not an action; expected a class such as FibonacciAction"
            ) from error


def publish(node: Node, publisher: Any, message: Any) -> None:
    """Publish a message; after the shutdown of the node do nothing.

    Raises:
        EncodeError: A value does not fit its field.
        ClosedError: The publisher is closed.
    """
    try:
        publisher.publish(message)
    except ClosedError:
        if not node.is_shutdown:
            raise


def run_callback(
    node: Node, action: str, callback: Callable[..., object] | None, *arguments: Any
) -> None:
    """Call a function of the program, if there is one, and log its failure."""
    if callback is None:
        return
    try:
        callback(*arguments)
    except (Exception, SystemExit) as error:  # noqa: BLE001  # the callback boundary
        node.log.report(f"callback of action '{action}' failed", error)
