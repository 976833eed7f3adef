"""The side of an actionlib server that clients of ROS 2 see."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rosz.actions.mapping import STATES, translate
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.std_msgs.msg import Header
from rosz.node.action_server import ActionServer as NativeServer
from rosz.node.action_server import ServerGoal as NativeGoal
from rosz.node.goals import FINAL, GoalState

if TYPE_CHECKING:
    from rosz.actions.types import ActionTypes
    from rosz.message import Action
    from rosz.node import Node

__all__ = ("Ros2Server",)

_KEEP_RESULTS = 900.0
_MOST_RESULTS = 200


class Ros2Server(NativeServer):
    """Hands goals of ROS 2's clients to a server, and lets the clients know what it does with them.

    Args:
        node: Node of the server.
        name: Full name of the action.
        types: Message classes of the action.
        action: Class of the action.
        receive_goal: Function that takes the message of a goal.
        receive_cancel: Function that takes a request to end a goal.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        types: ActionTypes,
        action: type[Action],
        receive_goal: Callable[[Any], object],
        receive_cancel: Callable[[GoalID], object],
    ) -> None:
        self._types = types
        self._receive_goal = receive_goal
        self._receive_cancel = receive_cancel
        self._mirrored: dict[str, NativeGoal] = {}
        super().__init__(
            node,
            name,
            action,
            lambda _: None,
            goal=None,
            cancel=None,
            policy="parallel",
            keep_results=_KEEP_RESULTS,
            most_results=_MOST_RESULTS,
        )

    def accepts(self, goal: NativeGoal) -> bool:
        """Hand a goal to the server; return whether that has not rejected it at once."""
        self.hand_over(goal)
        return str(goal.id) in self._mirrored or goal.done

    def hand_over(self, goal: NativeGoal) -> None:
        """Hand a goal to the server."""
        name, types, stamp = str(goal.id), self._types, Time.from_nsec(goal.accepted)
        self._mirrored[name] = goal
        request = translate(goal.request, types.goal)
        self._receive_goal(types.action_goal(Header(stamp=stamp), GoalID(stamp, name), request))

    def start(self, goal: NativeGoal) -> None:
        """Do nothing: the server executes the goal."""

    def allows_cancel(self, goal: NativeGoal) -> bool:
        """Let the server know that a client wants the goal to end."""
        self._receive_cancel(GoalID(id=str(goal.id)))
        return True

    def cancel_others(self, until: int) -> None:
        """Let the server know that a client wants goals to end, also those of actionlib's clients.

        Args:
            until: Time in nanoseconds until which they were sent; 0 for all goals.
        """
        self._receive_cancel(GoalID(stamp=Time.from_nsec(until)))

    def update(self, status: GoalStatus, result: Any) -> None:
        """Let the client of a goal know of its state.

        Args:
            status: State of the goal.
            result: Its result if it has ended; an empty one when not given.
        """
        goal = self._mirrored.get(status.goal_id.id)
        if goal is None:
            return
        state = STATES[status.status]
        if state in FINAL:
            del self._mirrored[status.goal_id.id]
        if status.status == GoalStatus.REJECTED and goal not in self.goals:
            return  # it is not accepted
        if state in {GoalState.CANCELING, GoalState.CANCELED}:
            self.begin_cancel(goal)
        elif goal.status is GoalState.ACCEPTED:
            self.begin(goal)
        if state in FINAL:
            outcome = None if result is None else translate(result, self.action_type.Result)
            self.end(goal, state, outcome)

    def send_feedback(self, name: str, feedback: Any) -> None:
        """Publish feedback about a goal of a client of ROS 2."""
        goal = self._mirrored.get(name)
        if goal is not None:
            self.publish_feedback(goal, translate(feedback, self.action_type.Feedback))
