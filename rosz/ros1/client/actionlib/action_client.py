"""actionlib.action_client: sending goals, many or one at a time (ROS wiki, actionlib)."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from rosz import actions, names
from rosz.actions import ActionlibClientGoal as ClientGoal
from rosz.actions import CommState
from rosz.errors import EncodeError
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.ros1 import state
from rosz.ros1.client import rospy
from rosz.ros1.exceptions import ROSSerializationException, raised_as

__all__ = (
    "ActionClient",
    "ClientGoalHandle",
    "CommState",
    "GoalManager",
    "TerminalState",
    "get_name_of_constant",
    "seconds",
)


def get_name_of_constant(C: type[Any], n: int) -> str:  # noqa: N803  # ROS 1's
    """Return the name of the constant of a class that has a value."""
    constants = (name for name, value in vars(C).items() if isinstance(value, int) and value == n)
    return next(constants, f"NO_SUCH_STATE_{n}")


class TerminalState:
    """States that a goal never leaves."""

    RECALLED = GoalStatus.RECALLED
    REJECTED = GoalStatus.REJECTED
    PREEMPTED = GoalStatus.PREEMPTED
    ABORTED = GoalStatus.ABORTED
    SUCCEEDED = GoalStatus.SUCCEEDED
    LOST = GoalStatus.LOST


for _class in (GoalStatus, CommState, TerminalState):
    _class.to_string = classmethod(get_name_of_constant)  # type: ignore[union-attr]


def seconds(duration: Any) -> float:
    """Return a duration, or a number of seconds, as seconds; 0 for None."""
    if duration is None:
        return 0.0
    return float(duration.to_sec()) if hasattr(duration, "to_sec") else float(duration)


class ClientGoalHandle:
    """A goal that was sent."""

    def __init__(self, goal: ClientGoal) -> None:
        self._goal = goal

    def __eq__(self, o: object) -> bool:
        return isinstance(o, ClientGoalHandle) and self._goal.id.id == o._goal.id.id

    def __hash__(self) -> int:
        return hash(self._goal.id.id)

    def cancel(self) -> None:
        """Ask the server to cancel the goal."""
        self._goal.cancel()

    def get_comm_state(self) -> int:
        """Return how far the exchange with the server is, a constant of `CommState`."""
        return self._goal.comm_state

    def get_goal_status(self) -> int:
        """Return the last known state, a constant of GoalStatus."""
        return self._goal.status.status

    def get_goal_status_text(self) -> str:
        """Return the text of the server about the state."""
        return self._goal.status.text

    def get_result(self) -> Any:
        """Return the result; None while there is none."""
        return self._goal.result

    def get_terminal_state(self) -> int:
        """Return the final state, a constant of `TerminalState`; LOST while there is none."""
        status = self._goal.status.status
        if self._goal.comm_state != CommState.DONE:
            name = get_name_of_constant(CommState, self._goal.comm_state)
            rospy.logwarn(f"Asking for the terminal state when we're in [{name}]")
        if get_name_of_constant(TerminalState, status).startswith("NO_SUCH"):
            rospy.logerr(f"the goal has no terminal state yet: its status is {status}")
            return GoalStatus.LOST
        return status


class GoalManager:
    """Sends the goals of a client."""

    def __init__(self, client: ActionClient) -> None:
        self._client = client.client

    def init_goal(
        self,
        goal: Any,
        transition_cb: Callable[[ClientGoalHandle], object] | None = None,
        feedback_cb: Callable[[ClientGoalHandle, Any], object] | None = None,
    ) -> ClientGoalHandle:
        """Send a goal; see `ActionClient.send_goal`."""
        sent: Future[ClientGoal] = Future()  # feedback may arrive before `send` returns

        def on_feedback(feedback: Any) -> None:
            if feedback_cb is not None:
                feedback_cb(ClientGoalHandle(sent.result()), feedback)

        def on_transition(changed: ClientGoal) -> None:
            if transition_cb is not None:
                transition_cb(ClientGoalHandle(changed))

        with raised_as(ROSSerializationException, EncodeError):
            new = self._client.send(goal, on_feedback=on_feedback, on_transition=on_transition)
        sent.set_result(new)
        return ClientGoalHandle(new)


class ActionClient:
    """Send goals to an action server, and follow all of them.

    Args:
        ns: Name of the action.
        ActionSpec: Class of the action, such as ``DoAction``.

    Attributes:
        ns: Full name of the action.
        manager: Sends the goals.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
        ActionException: The class is not that of an action.
    """

    def __init__(self, ns: str, ActionSpec: type[Any]) -> None:  # noqa: N803  # ROS 1's
        self.ns: str = ns
        self.ActionSpec: type[Any] = ActionSpec
        self.client = actions.ActionlibClient(state.node(), names.canonical(ns), ActionSpec)
        self.manager = GoalManager(self)
        whole = ActionSpec()
        self.ActionGoal: type[Any] = type(whole.action_goal)
        self.ActionResult: type[Any] = type(whole.action_result)
        self.ActionFeedback: type[Any] = type(whole.action_feedback)

    def send_goal(
        self,
        goal: Any,
        transition_cb: Callable[[ClientGoalHandle], object] | None = None,
        feedback_cb: Callable[[ClientGoalHandle, Any], object] | None = None,
    ) -> ClientGoalHandle:
        """Send a goal.

        Args:
            goal: The goal, such as a ``DoGoal``.
            transition_cb: Function called with the handle when its `CommState` has changed.
            feedback_cb: Function called with the handle and each feedback message.

        Returns:
            The handle of the goal.

        Raises:
            ROSSerializationException: The goal is not one of the action.
        """
        return self.manager.init_goal(goal, transition_cb, feedback_cb)

    def cancel_all_goals(self) -> None:
        """Ask the server to cancel all goals, including those of other clients."""
        self.client.publish_cancel(GoalID())

    def cancel_goals_at_and_before_time(self, time: Any) -> None:
        """Ask the server to cancel all goals that were sent until a time."""
        self.client.publish_cancel(GoalID(Time(time.secs, time.nsecs), ""))

    def wait_for_server(self, timeout: Any = None) -> bool:
        """Wait until a server of the action is connected; return whether one is.

        Args:
            timeout: Time limit, a Duration or seconds; none when not given or 0.
        """
        return self.client.wait_for_server(seconds(timeout))

    wait_for_action_server_to_start = wait_for_server

    def stop(self) -> None:
        """Close all topics; goals are not followed any more."""
        self.client.stop()


_SIMPLE = {GoalStatus.RECALLING: GoalStatus.PENDING, GoalStatus.PREEMPTING: GoalStatus.ACTIVE}
"""States that the simple client hides, and the states that it shows instead."""


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

    The arguments and errors are those of `ActionClient`.

    Attributes:
        ns: Full name of the action.
        action_client: Client that sends the goals.
    """

    def __init__(self, ns: str, ActionSpec: type[Any]) -> None:  # noqa: N803  # ROS 1's
        self.action_client: ActionClient = ActionClient(ns, ActionSpec)
        self._client = self.action_client.client
        self._goal: ClientGoal | None = None
        self.ns: str = self._client.name

    def wait_for_server(self, timeout: Any = None) -> bool:
        """Wait until a server is connected; see `ActionClient.wait_for_server`."""
        return self.action_client.wait_for_server(timeout)

    def send_goal(
        self,
        goal: Any,
        done_cb: Callable[[int, Any], object] | None = None,
        active_cb: Callable[[], object] | None = None,
        feedback_cb: Callable[[Any], object] | None = None,
    ) -> None:
        """Send a goal, and stop following the previous one; see `ActionClient.send_goal`.

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
        with raised_as(ROSSerializationException, EncodeError):
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
        """Wait until the goal has ended; see `ActionClient.wait_for_server`."""
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
