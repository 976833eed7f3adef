"""Goals of programs that know one protocol only, for servers that know only the other one.

Web pages and actionlib's programs in C++ have its topics alone, servers of ROS 2 services alone.
"""

from __future__ import annotations

import threading
from functools import partial
from typing import Any

from rosz.actions.actionlib_client import ActionlibClient, ActionlibClientGoal
from rosz.actions.actionlib_server import ActionlibServer, ActionlibServerGoal
from rosz.actions.translation import ActionlibToRos2, Ros2ToActionlib
from rosz.actions.types import ActionTypes
from rosz.errors import UsageError
from rosz.message import Action
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus
from rosz.node import Node
from rosz.node.actions import RUNNING

_ENDED = "the gateway to the server ended"


def _find_types(node: Node, action_type: type[Any]) -> tuple[ActionTypes, type[Action]]:
    """Return the message classes of an action, and its class for ROS 2."""
    types = ActionTypes.of(action_type, node.context.types)
    if types.action is None:
        raise UsageError(f"the definition of {action_type._type} is not found")
    return types, types.action


class TopicGateway:
    """Receive goals by actionlib's topics, and hand them to a server of ROS 2.

    Args:
        node: Node that has the topics.
        name: Full name of the action.
        action_type: Class of the action, such as ``FibonacciAction``.

    Raises:
        UsageError: The class is not that of an action, or the action's definition is not found.
    """

    def __init__(self, node: Node, name: str, action_type: type[Any]) -> None:
        types, action = _find_types(node, action_type)
        self._client = ActionlibToRos2(node, name, types, action)
        self._goals: dict[str, _ForwardedGoal] = {}
        self._server = ActionlibServer(
            node, name, action_type, self._receive, self._cancel, has_ros2=False
        )

    def start(self) -> bool:
        """Begin to receive goals if a server of ROS 2 has the action; return whether it has."""
        served = self._client.is_served(wait=True)
        if served:
            self._server.start()
        return served

    def close(self) -> None:
        """Receive no goals any more; clients take those that have not ended for aborted."""
        for goal in list(self._goals.values()):
            goal.finish(GoalStatus(goal.id, GoalStatus.LOST, _ENDED), None)
        self._server.stop()
        self._client.close()

    def _receive(self, goal: ActionlibServerGoal) -> None:
        followed = self._goals[goal.id.id] = _ForwardedGoal(goal, self._goals)
        self._client.send(followed, goal.message.goal)

    def _cancel(self, goal: ActionlibServerGoal) -> None:
        followed = self._goals.get(goal.id.id)
        if followed is not None:
            self._client.cancel(followed)


class _ForwardedGoal:
    """A goal that the server of ROS 2 has."""

    def __init__(self, goal: ActionlibServerGoal, goals: dict[str, _ForwardedGoal]) -> None:
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


class ServiceGateway:
    """Receive goals by ROS 2's services, and hand them to a server that has actionlib's topics.

    Arguments and errors are those of `TopicGateway`.
    """

    def __init__(self, node: Node, name: str, action_type: type[Any]) -> None:
        self._types, self._action = _find_types(node, action_type)
        self._client = ActionlibClient(node, name, action_type, has_ros2=False)
        self._lock = threading.Lock()
        self._goals: dict[str, ActionlibClientGoal] = {}
        self._server: Ros2ToActionlib | None = None

    def start(self) -> bool:
        """Begin to receive goals; return true."""
        client = self._client
        self._server = client.node.keep(
            Ros2ToActionlib(
                client.node,
                client.name,
                self._types,
                self._action,
                self._receive,
                self._cancel,
                remote=True,
            )
        )
        return True

    def close(self) -> None:
        """Receive no goals any more; clients learn that the server has ended."""
        if self._server is not None:
            self._server.close()
        self._client.stop()

    def _receive(self, message: Any) -> None:
        name = message.goal_id.id
        with self._lock:  # a cancellation comes after its goal
            self._goals[name] = self._client.send(
                message.goal,
                on_done=partial(self._finish, name),
                on_feedback=partial(self._send_feedback, name),
                on_transition=partial(self._follow, name),
            )

    def _cancel(self, goal_id: GoalID) -> None:
        if not goal_id.id:
            self._client.publish_cancel(goal_id)
            return
        with self._lock:
            goal = self._goals.get(goal_id.id)
        if goal is not None:
            goal.cancel()

    def _send_feedback(self, name: str, feedback: Any) -> None:
        if self._server is not None:
            self._server.send_feedback(name, feedback)

    def _follow(self, name: str, goal: ActionlibClientGoal) -> None:
        """Pass on a state that is not the end of the goal."""
        if goal.status.status in RUNNING | {GoalStatus.RECALLING}:
            self._update(name, goal.status.status, None)

    def _finish(self, name: str, goal: ActionlibClientGoal) -> None:
        """Pass on the end of the goal."""
        lost = goal.status.status == GoalStatus.LOST
        self._update(name, GoalStatus.ABORTED if lost else goal.status.status, goal.result)
        with self._lock:
            self._goals.pop(name, None)

    def _update(self, name: str, status: int, result: Any) -> None:
        if self._server is not None:
            self._server.update(GoalStatus(GoalID(id=name), status), result)
