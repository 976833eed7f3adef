"""The side of an actionlib server that clients of ROS 2 see."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosz.actions.mapping import STATES, translate
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.std_msgs.msg import Header
from rosz.node.action_server import ActionServer as NativeServer
from rosz.node.action_server import ServerGoal as NativeGoal
from rosz.node.goals import FINAL, GoalState

if TYPE_CHECKING:
    from rosz.actions.server import ActionServer, ServerGoal
    from rosz.message import Action

__all__ = ("Ros2Server",)

_KEEP_RESULTS = 900.0
_MOST_RESULTS = 200


class Ros2Server(NativeServer):
    """Hands goals of ROS 2's clients to a server, and lets the clients know what it does with them.

    Args:
        server: The server.
        action: Class of the action.
    """

    def __init__(self, server: ActionServer, action: type[Action]) -> None:
        self._server = server
        self._mirrored: dict[str, NativeGoal] = {}
        super().__init__(
            server.node,
            server.name,
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
        name, types, stamp = str(goal.id), self._server.types, Time.from_nsec(goal.accepted)
        self._mirrored[name] = goal
        request = translate(goal.request, types.goal)
        self._server.receive_goal(
            types.action_goal(Header(stamp=stamp), GoalID(stamp, name), request)
        )
        return not any(
            one.id.id == name and one.status.status == GoalStatus.REJECTED
            for one in list(self._server.goals)
        )

    def start(self, goal: NativeGoal) -> None:
        """Do nothing: the server executes the goal."""

    def allows_cancel(self, goal: NativeGoal) -> bool:
        """Let the server know that a client wants the goal to end."""
        self._server.receive_cancel(GoalID(id=str(goal.id)))
        return True

    def update(self, changed: ServerGoal, result: Any) -> None:
        """Let the client of a goal know of its state.

        Args:
            changed: The goal.
            result: Its result if it has ended; an empty one when not given.
        """
        goal = self._mirrored.get(changed.id.id)
        if goal is None:
            return
        state = STATES[changed.status.status]
        if state in FINAL:
            del self._mirrored[changed.id.id]
        if changed.status.status == GoalStatus.REJECTED and goal not in self.goals:
            return  # see `accepts`
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
