"""actionlib.simple_action_client: sending one goal at a time (ROS wiki, actionlib)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rosz.actions import ClientGoal
from rosz.errors import EncodeError
from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.ros1.actionlib.action_client import (
    ActionClient,
    ClientGoalHandle,
    get_name_of_constant,
    seconds,
)
from rosz.ros1.exceptions import ROSSerializationException

__all__ = ("SimpleActionClient", "SimpleGoalState")

_SIMPLE = {GoalStatus.RECALLING: GoalStatus.PENDING, GoalStatus.PREEMPTING: GoalStatus.ACTIVE}
"""States that the simple client does not show, and the ones that it shows instead."""


class SimpleGoalState:
    """Values of `SimpleActionClient.simple_state`."""

    PENDING = 0
    ACTIVE = 1
    DONE = 2

    @classmethod
    def to_string(cls, state: int) -> str:
        """Return the name of a value."""
        return get_name_of_constant(cls, state)


class SimpleActionClient:
    """Send one goal at a time to an action server, and follow the newest one.

    Args:
        ns: Name of the action.
        ActionSpec: Class of the action, such as ``DoAction``.

    Attributes:
        ns: Full name of the action.
        action_client: Client that sends the goals.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
        ActionException: The class is not that of an action.
    """

    def __init__(self, ns: str, ActionSpec: type[Any]) -> None:  # noqa: N803  # ROS 1's
        self.action_client: ActionClient = ActionClient(ns, ActionSpec)
        self._client = self.action_client.client
        self._goal: ClientGoal | None = None
        self.ns: str = self._client.name

    def wait_for_server(self, timeout: Any = None) -> bool:
        """Wait until a server of the action is connected.

        Args:
            timeout: Time limit, a Duration or seconds; none when not given or 0.

        Returns:
            Whether one is.
        """
        return self.action_client.wait_for_server(timeout)

    def send_goal(
        self,
        goal: Any,
        done_cb: Callable[[int, Any], object] | None = None,
        active_cb: Callable[[], object] | None = None,
        feedback_cb: Callable[[Any], object] | None = None,
    ) -> None:
        """Send a goal, and stop following the previous one.

        Args:
            goal: The goal, such as a ``DoGoal``.
            done_cb: Function called with the final state and the result.
            active_cb: Function called when the server begins to execute the goal.
            feedback_cb: Function called with each feedback message.

        Raises:
            ROSSerializationException: The goal is not one of the action.
        """

        def on_done(sent: ClientGoal) -> None:
            if done_cb is not None:
                done_cb(_simple_state(sent), sent.result)

        self.stop_tracking_goal()
        try:
            self._goal = self._client.send(
                goal, on_done=on_done, on_active=active_cb, on_feedback=feedback_cb
            )
        except EncodeError as error:
            raise ROSSerializationException(str(error)) from error

    def send_goal_and_wait(
        self, goal: Any, execute_timeout: Any = None, preempt_timeout: Any = None
    ) -> int:
        """Send a goal, wait until it has ended, and cancel it if that takes too long.

        Args:
            goal: The goal, such as a ``DoGoal``.
            execute_timeout: Time limit for the goal; none when not given or 0.
            preempt_timeout: Time limit after the cancellation; none when not given or 0.

        Returns:
            The final state.
        """
        self.send_goal(goal)
        if not self.wait_for_result(execute_timeout):
            self.cancel_goal()
            self.wait_for_result(preempt_timeout)
        return self.get_state()

    def wait_for_result(self, timeout: Any = None) -> bool:
        """Wait until the goal has ended.

        Args:
            timeout: Time limit, a Duration or seconds; none when not given or 0.

        Returns:
            Whether it has ended.
        """
        if self._goal is None:
            self._client.node.log.error("cannot wait for a result: no goal was sent")
            return False
        return self._goal.wait(seconds(timeout))

    @property
    def gh(self) -> ClientGoalHandle | None:
        """The handle of the goal; None without a goal."""
        return None if self._goal is None else ClientGoalHandle(self._goal)

    def get_result(self) -> Any:
        """Return the result; None while there is none."""
        return None if self._goal is None else self._goal.result

    def get_state(self) -> int:
        """Return the state of the goal, a constant of GoalStatus; LOST without a goal."""
        return GoalStatus.LOST if self._goal is None else _simple_state(self._goal)

    @property
    def simple_state(self) -> int:
        """The progress of the goal, a constant of `SimpleGoalState`."""
        if self._goal is None or self._goal.done:
            return SimpleGoalState.DONE
        return SimpleGoalState.ACTIVE if self._goal.started else SimpleGoalState.PENDING

    def get_goal_status_text(self) -> str:
        """Return the text of the server about the state of the goal."""
        return "" if self._goal is None else self._goal.status.text

    def cancel_goal(self) -> None:
        """Ask the server to cancel the goal."""
        if self._goal is not None:
            self._goal.cancel()

    def cancel_all_goals(self) -> None:
        """Ask the server to cancel all goals, including those of other clients."""
        self.action_client.cancel_all_goals()

    def cancel_goals_at_and_before_time(self, time: Any) -> None:
        """Ask the server to cancel all goals that were sent until a time."""
        self.action_client.cancel_goals_at_and_before_time(time)

    def stop_tracking_goal(self) -> None:
        """Stop following the goal; the server continues with it."""
        if self._goal is not None:
            self._goal.forget()
            self._goal = None


def _simple_state(goal: ClientGoal) -> int:
    return _SIMPLE.get(goal.status.status, goal.status.status)
