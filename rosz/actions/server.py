"""Action servers, which execute one goal at a time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from rosz.actions.types import RUNNING, TERMINAL, ActionTypes, run_callback
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.std_msgs.msg import Header
from rosz.node import Node
from rosz.qos import QoS
from rosz.worker import Worker

__all__ = ("ActionServer", "ServerGoal")

_STATUS_PERIOD = 0.2
_STATUS_KEPT = 5 * 10**9
"""Nanoseconds for which the state of a goal that has ended is still published."""

_SUPERSEDED = "This goal was canceled because another goal was received by the simple action server"
_QUEUE = QoS(depth=50)


class ServerGoal:
    """A goal that was received.

    Args:
        message: Message that carried the goal.
        now: Time of arrival in nanoseconds.

    Attributes:
        id: Identification of the goal.
        goal: The goal message.
        status: State of the goal.
        ended_at: Time of its end in nanoseconds; 0 while it has not ended.
        cancelled: Whether its cancellation was requested.
        order: Time in nanoseconds by which goals are ordered.
    """

    def __init__(self, message: Any, now: int) -> None:
        stamp = message.goal_id.stamp
        self.id: GoalID = GoalID(stamp, message.goal_id.id)
        self.goal: Any = message.goal
        self.status: GoalStatus = GoalStatus(self.id, GoalStatus.PENDING)
        self.ended_at: int = 0
        self.cancelled: bool = False
        self.order: int = stamp.to_nsec() or now


class ActionServer:
    """Execute one goal at a time; a newer goal preempts the current one.

    A goal that arrives becomes the `next_goal`, and recalls an earlier one that still waits there.
    `accept_new_goal` makes it the `current_goal`. Without ``execute``, the program calls that when
    `on_goal` is called.

    Args:
        node: Node that the server belongs to.
        name: Name of the action; resolved and remapped.
        action_type: Class of the action, such as ``FibonacciAction``.
        execute: Function called with each goal message on a thread of the server. It must end with
            `set_succeeded`, `set_aborted` or `set_preempted`.

    Attributes:
        node: As given.
        name: Full name of the action.
        current_goal: Goal that was accepted last; None at first.
        next_goal: Goal that waits to be accepted.
        on_goal: Function called when a goal has arrived.
        on_preempt: Function called when the current goal is asked to end.

    Raises:
        UsageError: The class is not that of an action.
    """

    _goal_class: type[ServerGoal] = ServerGoal

    def __init__(
        self,
        node: Node,
        name: str,
        action_type: type[Any],
        execute: Callable[[Any], object] | None = None,
    ) -> None:
        self._types = ActionTypes.of(action_type)
        self.node: Node = node
        self.name: str = node.resolve(name)
        self.execute_callback: Callable[[Any], object] | None = execute
        self.current_goal: Any = None
        self.next_goal: Any = None
        self.on_goal: Callable[[], object] | None = None
        self.on_preempt: Callable[[], object] | None = None
        self._goals: dict[str, ServerGoal] = {}
        self._changed = threading.Condition(threading.RLock())
        self._publishers: dict[str, Any] = {}

    def start(self) -> None:
        """Begin to receive goals."""
        node, types = self.node, self._types
        self._publishers = {
            "status": node.publisher(f"{self.name}/status", GoalStatusArray, qos=_QUEUE),
            "result": node.publisher(f"{self.name}/result", types.action_result, qos=_QUEUE),
            "feedback": node.publisher(f"{self.name}/feedback", types.action_feedback, qos=_QUEUE),
        }
        node.subscription(f"{self.name}/cancel", GoalID, self._receive_cancel, qos=_QUEUE)
        node.subscription(f"{self.name}/goal", types.action_goal, self._receive_goal, qos=_QUEUE)
        node.timer(_STATUS_PERIOD, lambda _: self._publish_status())
        if self.execute_callback is not None:
            Worker(f"rosz-action{self.name}", self._execute, receive=self._wait_for_goal)
        node.on_shutdown(lambda _: self._wake())

    def is_new_goal_available(self) -> bool:
        """Return whether there is a goal to accept."""
        return self.next_goal is not None

    def is_preempt_requested(self) -> bool:
        """Return whether the current goal was cancelled or a newer goal waits."""
        with self._changed:
            goal = self.current_goal
            return goal is not None and (goal.cancelled or self.next_goal is not None)

    def is_active(self) -> bool:
        """Return whether a goal is being executed."""
        goal = self.current_goal
        return goal is not None and goal.status.status in RUNNING

    def accept_new_goal(self) -> Any:
        """Accept the goal that waits; a goal that is being executed is preempted.

        Returns:
            The goal message; None if no goal waits.
        """
        with self._changed:
            goal = self.next_goal
            if goal is None:
                self.node.log.error("cannot accept a goal: none is waiting")
                return None
            if self.is_active():
                self.set_preempted(text=_SUPERSEDED)
            self.current_goal, self.next_goal = goal, None
            goal.status.status = GoalStatus.PREEMPTING if goal.cancelled else GoalStatus.ACTIVE
            goal.status.text = "This goal has been accepted by the simple action server"
        self._publish_status()
        return goal.goal

    def set_succeeded(self, result: Any = None, text: str = "") -> None:
        """End the current goal as succeeded."""
        self._end_current(GoalStatus.SUCCEEDED, result, text)

    def set_aborted(self, result: Any = None, text: str = "") -> None:
        """End the current goal as aborted."""
        self._end_current(GoalStatus.ABORTED, result, text)

    def set_preempted(self, result: Any = None, text: str = "") -> None:
        """End the current goal as preempted: cancelled, or replaced by a newer one."""
        self._end_current(GoalStatus.PREEMPTED, result, text)

    def publish_feedback(self, feedback: Any) -> None:
        """Publish feedback about the current goal."""
        goal = self.current_goal
        if goal is None:
            self.node.log.error("cannot publish feedback: no goal was accepted")
            return
        message = self._types.action_feedback(self._header(), goal.status, feedback)
        self._publishers["feedback"].publish(message)

    def get_default_result(self) -> Any:
        """Return an empty result message."""
        return self._types.result()

    def _header(self) -> Header:
        return Header(stamp=Time(*divmod(self.node.now(), 10**9)))

    def _wake(self) -> None:
        with self._changed:
            self._changed.notify_all()

    def _receive_goal(self, message: Any) -> None:
        with self._changed:
            if message.goal_id.id in self._goals:
                return  # sent twice
            goal = self._goal_class(message, self.node.now())
            self._goals[goal.id.id] = goal
            newest = max(
                (one.order for one in (self.current_goal, self.next_goal) if one is not None),
                default=0,
            )
            if goal.order < newest:
                self._end(goal, GoalStatus.RECALLED, None, _SUPERSEDED)
                return
            older, self.next_goal = self.next_goal, goal
            if older is not None:
                self._end(older, GoalStatus.RECALLED, None, _SUPERSEDED)
            preempts = self.is_active()
            self._changed.notify_all()
        self._publish_status()
        if preempts:
            run_callback(self.node, self.name, self.on_preempt)
        run_callback(self.node, self.name, self.on_goal)

    def _receive_cancel(self, message: GoalID) -> None:
        until = message.stamp.to_nsec()
        everything = not message.id and not until
        with self._changed:
            cancelled = [
                goal
                for goal in self._goals.values()
                if goal.status.status not in TERMINAL
                and (everything or goal.id.id == message.id or (until and goal.order <= until))
            ]
            for goal in cancelled:
                goal.cancelled = True
                active = goal.status.status == GoalStatus.ACTIVE
                goal.status.status = GoalStatus.PREEMPTING if active else GoalStatus.RECALLING
            current = any(goal is self.current_goal for goal in cancelled)
            self._changed.notify_all()
        self._publish_status()
        if current:
            run_callback(self.node, self.name, self.on_preempt)

    def _end_current(self, status: int, result: Any, text: str) -> None:
        with self._changed:
            goal = self.current_goal
            if goal is None or goal.status.status in TERMINAL:
                self.node.log.error("cannot end a goal: none is being executed")
                return
            self._end(goal, status, result, text)

    def _end(self, goal: ServerGoal, status: int, result: Any, text: str) -> None:
        goal.status.status, goal.status.text = status, text
        goal.ended_at = self.node.now()
        outcome = self._types.result() if result is None else result
        message = self._types.action_result(self._header(), goal.status, outcome)
        self._publishers["result"].publish(message)
        self._publish_status()

    def _publish_status(self) -> None:
        with self._changed:
            now = self.node.now()
            self._goals = {
                name: goal
                for name, goal in self._goals.items()
                if not goal.ended_at or now - goal.ended_at < _STATUS_KEPT
            }
            statuses = [goal.status for goal in self._goals.values()]
            self._publishers["status"].publish(GoalStatusArray(self._header(), statuses))

    def _wait_for_goal(self) -> Any:
        """Accept the next goal when it has arrived; None when the node is shut down."""
        with self._changed:
            while not self.node.is_shutdown:
                if self.next_goal is not None:
                    return self.accept_new_goal()
                self._changed.wait(_STATUS_PERIOD)
        return None

    def _execute(self, goal: Any) -> None:
        node, execute = self.node, self.execute_callback
        if execute is None:
            return
        try:
            execute(goal)
        except (Exception, SystemExit) as error:  # noqa: BLE001  # the callback boundary
            if node.is_shutdown:
                return
            node.log.report(f"the execute function of action '{self.name}' failed", error)
            if self.is_active():
                self.set_aborted(None, f"Exception in execute callback: {error}")
            return
        if self.is_active() and not node.is_shutdown:
            node.log.warning(
                "the execute function of action '%s' returned without ending the goal, which is"
                " aborted; call set_succeeded, set_aborted or set_preempted",
                self.name,
            )
            self.set_aborted(None, "No terminal state was set.")
