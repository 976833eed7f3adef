"""actionlib: the simple action client and server of ROS 1 (ROS wiki, actionlib).

Each handles one goal at a time. ``ActionClient``, ``ActionServer`` and their goal handles are
missing; `rosz.actions` holds the logic.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rosz.actions import ActionClient, ActionServer, ClientGoal, ServerGoal
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.ros1 import state

__all__ = ("SimpleActionClient", "SimpleActionServer", "SimpleGoalState")

_SIMPLE = {GoalStatus.RECALLING: GoalStatus.PENDING, GoalStatus.PREEMPTING: GoalStatus.ACTIVE}
"""States that the simple client does not show, and the ones that it shows instead."""


class SimpleGoalState:
    """Values of `SimpleActionClient.simple_state`."""

    PENDING = 0
    ACTIVE = 1
    DONE = 2


class SimpleActionClient:
    """Send one goal at a time to an action server, and follow the newest one.

    Args:
        ns: Name of the action.
        ActionSpec: Class of the action, such as ``DoAction``.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
        UsageError: The class is not that of an action.
    """

    def __init__(self, ns: str, ActionSpec: type[Any]) -> None:  # noqa: N803  # ROS 1's
        self._client = ActionClient(state.node(), ns, ActionSpec)
        self._goal: ClientGoal | None = None
        self.ns: str = self._client.name

    def wait_for_server(self, timeout: Any = None) -> bool:
        """Wait until a server of the action is connected.

        Args:
            timeout: Time limit, a Duration or seconds; none when not given or 0.

        Returns:
            Whether one is.
        """
        return self._client.wait_for_server(_seconds(timeout))

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
        """

        def on_done(sent: ClientGoal) -> None:
            if done_cb is not None:
                done_cb(_simple_state(sent), sent.result)

        self.stop_tracking_goal()
        self._goal = self._client.send(
            goal, on_done=on_done, on_active=active_cb, on_feedback=feedback_cb
        )

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
        return self._goal.wait(_seconds(timeout))

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
        self._client.publish_cancel(GoalID())

    def cancel_goals_at_and_before_time(self, time: Any) -> None:
        """Ask the server to cancel all goals that were sent until a time."""
        self._client.publish_cancel(GoalID(Time(time.secs, time.nsecs), ""))

    def stop_tracking_goal(self) -> None:
        """Stop following the goal; the server continues with it."""
        if self._goal is not None:
            self._goal.forget()
            self._goal = None


class _Goal(ServerGoal):
    """A goal with the methods of ROS 1's goal handles."""

    def get_goal(self) -> Any:
        """Return the goal message."""
        return self.goal

    def get_goal_id(self) -> GoalID:
        """Return the identification of the goal."""
        return self.id

    def get_goal_status(self) -> GoalStatus:
        """Return the state of the goal."""
        return self.status


class SimpleActionServer(ActionServer):
    """Execute one goal at a time; a newer goal preempts the current one.

    Args:
        name: Name of the action.
        ActionSpec: Class of the action, such as ``DoAction``.
        execute_cb: Function called with each goal on a thread of its own. It must end with
            `set_succeeded`, `set_aborted` or `set_preempted`. Without one, use
            `register_goal_callback` and `accept_new_goal`.
        auto_start: Whether the server starts at once, and not with `start`.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
        UsageError: The class is not that of an action.
    """

    _goal_class = _Goal

    def __init__(
        self,
        name: str,
        ActionSpec: type[Any],  # noqa: N803  # ROS 1's
        execute_cb: Callable[[Any], object] | None = None,
        auto_start: bool = True,
    ) -> None:
        super().__init__(state.node(), name, ActionSpec, execute_cb)
        if auto_start:
            self.start()

    def register_goal_callback(self, cb: Callable[[], object]) -> None:
        """Call a function when there is a new goal to accept."""
        if self.execute_callback is not None:
            self.node.log.warning(
                "register_goal_callback() has no effect: the server has an execute callback"
            )
        else:
            self.on_goal = cb

    def register_preempt_callback(self, cb: Callable[[], object]) -> None:
        """Call a function when the goal is asked to end."""
        self.on_preempt = cb


def _simple_state(goal: ClientGoal) -> int:
    return _SIMPLE.get(goal.status.status, goal.status.status)


def _seconds(duration: Any) -> float:
    """Return a duration, or a number of seconds, as seconds; 0 for None."""
    if duration is None:
        return 0.0
    return float(duration.to_sec()) if hasattr(duration, "to_sec") else float(duration)
