"""The message classes of an action, and the kinds of goal states."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec

from rosz.errors import ClosedError, TypeNotFound, UsageError
from rosz.message import Action
from rosz.node import Node
from rosz.typestore import TypeStore


class ActionTypes(msgspec.Struct, frozen=True):
    """The message classes of an action.

    Attributes:
        action_goal: Class of the messages on ``goal``.
        action_result: Class of the messages on ``result``.
        action_feedback: Class of the messages on ``feedback``.
        goal: Class of the goal itself.
        result: Class of the result itself.
        feedback: Class of the feedback itself.
        action: Class of the action for ROS 2; None if no definition of it is found.
    """

    action_goal: type[Any]
    action_result: type[Any]
    action_feedback: type[Any]
    goal: type[Any]
    result: type[Any]
    feedback: type[Any]
    action: type[Action] | None

    @classmethod
    def of(cls, action_type: type[Any], types: TypeStore) -> ActionTypes:
        """Return the message classes of an action.

        Args:
            action_type: Class of the action, such as ``FibonacciAction``.
            types: Where its definition is found.

        Raises:
            UsageError: The class is not that of an action.
        """
        try:
            whole = action_type()
            goal, result, feedback = whole.action_goal, whole.action_result, whole.action_feedback
            return cls(
                action_goal=type(goal),
                action_result=type(result),
                action_feedback=type(feedback),
                goal=type(goal.goal),
                result=type(result.result),
                feedback=type(feedback.feedback),
                action=_find_action(action_type, types),
            )
        except AttributeError as error:
            raise UsageError(
                f"{action_type.__name__} is not an action; expected a class such as FibonacciAction"
            ) from error


def _find_action(action_type: type[Any], types: TypeStore) -> type[Action] | None:
    package, _, name = action_type._type_name.split("/")
    try:
        return types.action(f"{package}/{name.removesuffix('Action')}")
    except TypeNotFound:
        return None


def publish(node: Node, publisher: Any, message: Any) -> None:
    """Publish a message; after the shutdown of the node do nothing."""
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
