"""Servers of ROS 2 for programs that speak actionlib by its topics alone, such as web pages."""

from __future__ import annotations

from typing import Any

from rosz.actions.ros2_client import Ros2Client
from rosz.actions.server import ActionServer, ServerGoal
from rosz.actions.types import ActionTypes
from rosz.errors import UsageError
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus
from rosz.node import Node

__all__ = ("ActionGateway",)


class ActionGateway:
    """Receive goals by actionlib's topics, and hand them to a server of ROS 2.

    Args:
        node: Node that has the topics.
        name: Full name of the action.
        action_type: Class of the action, such as ``FibonacciAction``.

    Raises:
        UsageError: The class is not that of an action, or the action's definition is not found.
    """

    def __init__(self, node: Node, name: str, action_type: type[Any]) -> None:
        types = ActionTypes.of(action_type, node.context.types)
        if types.action is None:
            raise UsageError(f"the definition of {action_type._type} is not found")
        self._client = Ros2Client(node, name, types, types.action)
        self._goals: dict[str, _Goal] = {}
        self._server = ActionServer(
            node, name, action_type, self._receive, self._cancel, has_ros2=False
        )

    def start(self) -> bool:
        """Begin to receive goals if a server of ROS 2 has the action; return whether it has."""
        served = self._client.is_served(wait=True)
        if served:
            self._server.start()
        return served

    def close(self) -> None:
        """Receive no goals any more; those that have not ended are left to their server."""
        self._server.stop()
        self._client.close()

    def _receive(self, goal: ServerGoal) -> None:
        followed = self._goals[goal.id.id] = _Goal(goal, self._goals)
        self._client.send(followed, goal.message.goal)

    def _cancel(self, goal: ServerGoal) -> None:
        followed = self._goals.get(goal.id.id)
        if followed is not None:
            self._client.cancel(followed)


class _Goal:
    """A goal that the server of ROS 2 has."""

    def __init__(self, goal: ServerGoal, goals: dict[str, _Goal]) -> None:
        self.id: GoalID = goal.id
        self._goal = goal
        self._goals = goals

    def advance(self, status: GoalStatus) -> None:
        """Note a state that is not the end of the goal."""
        if status.status == GoalStatus.ACTIVE and self._goal.status.status == GoalStatus.PENDING:
            self._goal.accept()
        elif status.status == GoalStatus.PREEMPTING:
            self._goal.request_cancel()

    def receive_feedback(self, feedback: Any) -> None:
        """Pass feedback on."""
        self._goal.publish_feedback(feedback)

    def finish(self, status: GoalStatus, result: Any) -> None:
        """Pass the end of the goal on."""
        self._goals.pop(self.id.id, None)
        goal = self._goal
        if status.status == GoalStatus.REJECTED:
            goal.reject(result, status.text)
            return
        if goal.status.status in (GoalStatus.PENDING, GoalStatus.RECALLING):
            goal.accept()
        if status.status == GoalStatus.SUCCEEDED:
            goal.succeed(result, status.text)
        elif status.status == GoalStatus.PREEMPTED:
            goal.cancel(result, status.text)
        else:
            goal.abort(result, status.text)
