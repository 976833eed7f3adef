"""Sending goals."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from typing import Any

from rosz.errors import WaitTimeout
from rosz.graph import View
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.std_msgs.msg import Header
from rosz.node import Node
from rosz.ros1 import state
from rosz.ros1.actionlib.types import TERMINAL, ActionTypes, seconds_of

__all__ = ("SimpleActionClient", "SimpleGoalState")

_FOREVER = threading.TIMEOUT_MAX / 2
_LOOK_SECONDS = 0.1
_NUMBERS = itertools.count(1)


class SimpleGoalState:
    """How far a goal is, for `SimpleActionClient.simple_state`."""

    PENDING = 0
    ACTIVE = 1
    DONE = 2


class _Goal:
    """A goal that was sent, and what is known of it."""

    def __init__(
        self, goal_id: GoalID, done: Any = None, active: Any = None, feedback: Any = None
    ) -> None:
        self.id = goal_id
        self.on_done: Callable[[int, Any], object] | None = done
        self.on_active: Callable[[], object] | None = active
        self.on_feedback: Callable[[Any], object] | None = feedback
        self.status = GoalStatus(goal_id, GoalStatus.PENDING)
        self.result: Any = None
        self.seen = False
        self.is_active = False
        self.done = threading.Event()


class SimpleActionClient:
    """Sends one goal at a time to an action server; the newest is the one that counts.

    Args:
        ns: Name of the action.
        ActionSpec: Its class, ``DoAction``.

    Raises:
        ROSInitException: The process is no node yet.
        UsageError: The class is none of an action.
    """

    def __init__(self, ns: str, ActionSpec: type[Any]) -> None:  # noqa: N803  # ROS 1's
        self._types = ActionTypes.of(ActionSpec)
        self._node: Node = state.node()
        self.ns = self._node.resolve(ns)
        self._lock = threading.Lock()
        self._goal: _Goal | None = None
        node, types = self._node, self._types
        self._goals = node.publisher(f"{self.ns}/goal", types.action_goal)
        self._cancels = node.publisher(f"{self.ns}/cancel", GoalID)
        self._parts = [
            node.subscription(f"{self.ns}/status", GoalStatusArray, self._on_status),
            node.subscription(f"{self.ns}/feedback", types.action_feedback, self._on_feedback),
            node.subscription(f"{self.ns}/result", types.action_result, self._on_result),
        ]

    def wait_for_server(self, timeout: Any = None) -> bool:
        """Wait until a server of the action is there.

        Args:
            timeout: How long; for ever when not given or 0.

        Returns:
            Whether one is there.
        """
        topics = ("status", "feedback", "result")

        def is_there(view: View) -> bool:
            return all(view.publishers(f"{self.ns}/{one}") for one in topics) and all(
                publisher.subscribers() for publisher in (self._goals, self._cancels)
            )

        graph = self._node.context.graph
        try:
            graph.wait_for(is_there, seconds_of(timeout) or _FOREVER, f"action server '{self.ns}'")
        except WaitTimeout:
            return False
        return True

    def send_goal(
        self,
        goal: Any,
        done_cb: Callable[[int, Any], object] | None = None,
        active_cb: Callable[[], object] | None = None,
        feedback_cb: Callable[[Any], object] | None = None,
    ) -> None:
        """Send a goal, and follow no earlier one any more.

        Args:
            goal: ``DoGoal``.
            done_cb: Gets the final state and the result.
            active_cb: Called when work on it begins.
            feedback_cb: Gets feedback.
        """
        now = self._now()
        made = GoalID(now, f"{self._node.name}-{next(_NUMBERS)}-{now.sec}.{now.nanosec:09d}")
        with self._lock:
            self._goal = _Goal(made, done_cb, active_cb, feedback_cb)
        self._goals.publish(self._types.action_goal(Header(stamp=now), made, goal))

    def send_goal_and_wait(
        self, goal: Any, execute_timeout: Any = None, preempt_timeout: Any = None
    ) -> int:
        """Send a goal, and wait until it is done; cancel it if that takes too long.

        Args:
            goal: ``DoGoal``.
            execute_timeout: How long to wait; for ever when not given or 0.
            preempt_timeout: How long to wait after it was cancelled; likewise.

        Returns:
            The final state.
        """
        self.send_goal(goal)
        if not self.wait_for_result(execute_timeout):
            self.cancel_goal()
            self.wait_for_result(preempt_timeout)
        return self.get_state()

    def wait_for_result(self, timeout: Any = None) -> bool:
        """Wait until the goal is done.

        Args:
            timeout: How long; for ever when not given or 0.

        Returns:
            Whether it is done.
        """
        goal = self._goal
        if goal is None:
            self._node.log.error("Called wait_for_result when no goal exists")
            return False
        limit = round((seconds_of(timeout) or _FOREVER) * 1e9)
        began = self._node.now()
        while not goal.done.wait(_LOOK_SECONDS):
            if self._node.is_shutdown or self._node.now() - began >= limit:
                return goal.done.is_set()
        return True

    def get_result(self) -> Any:
        """Return the result; None while there is none."""
        return None if self._goal is None else self._goal.result

    def get_state(self) -> int:
        """Return the state of the goal, a constant of GoalStatus; LOST where there is none."""
        if self._goal is None:
            return GoalStatus.LOST
        known = self._goal.status.status
        simple = {
            GoalStatus.RECALLING: GoalStatus.PENDING,
            GoalStatus.PREEMPTING: GoalStatus.ACTIVE,
        }
        return simple.get(known, known)

    @property
    def simple_state(self) -> int:
        """How far the goal is, a constant of `SimpleGoalState`."""
        if self._goal is None or self._goal.done.is_set():
            return SimpleGoalState.DONE
        return SimpleGoalState.ACTIVE if self._goal.is_active else SimpleGoalState.PENDING

    def get_goal_status_text(self) -> str:
        """Return what the server says about the state of the goal."""
        return "" if self._goal is None else self._goal.status.text

    def cancel_goal(self) -> None:
        """Ask the server to give the goal up."""
        if self._goal is not None:
            self._cancels.publish(GoalID(Time(), self._goal.id.id))

    def cancel_all_goals(self) -> None:
        """Ask the server to give all goals up, those of others, too."""
        self._cancels.publish(GoalID())

    def cancel_goals_at_and_before_time(self, time: Any) -> None:
        """Ask the server to give all goals up that were sent until a time."""
        self._cancels.publish(GoalID(Time(time.secs, time.nsecs), ""))

    def stop_tracking_goal(self) -> None:
        """Follow the goal no more; it goes on."""
        with self._lock:
            self._goal = None

    def _now(self) -> Time:
        return Time(*divmod(self._node.now(), 10**9))

    def _of(self, goal_id: GoalID) -> _Goal | None:
        goal = self._goal
        return goal if goal is not None and goal.id.id == goal_id.id else None

    def _on_status(self, message: GoalStatusArray) -> None:
        goal = self._goal
        if goal is None or goal.done.is_set():
            return
        for status in message.status_list:
            if status.goal_id.id == goal.id.id:
                goal.seen = True
                self._advance(goal, status)
                return
        if goal.seen:  # a server that does not know it any more has been started anew
            lost = GoalStatus(
                goal.id, GoalStatus.LOST, "the server does not know the goal any more"
            )
            self._finish(goal, lost, None)

    def _advance(self, goal: _Goal, status: GoalStatus) -> None:
        with self._lock:
            if goal.done.is_set() or status.status in TERMINAL:
                return  # the result tells, and comes along with it
            goal.status = status
            begins = not goal.is_active and status.status in {
                GoalStatus.ACTIVE,
                GoalStatus.PREEMPTING,
            }
            goal.is_active = goal.is_active or begins
        if begins and goal.on_active is not None:
            self._call(goal.on_active)

    def _on_feedback(self, message: Any) -> None:
        goal = self._of(message.status.goal_id)
        if goal is not None and goal.on_feedback is not None and not goal.done.is_set():
            self._call(goal.on_feedback, message.feedback)

    def _on_result(self, message: Any) -> None:
        goal = self._of(message.status.goal_id)
        if goal is not None:
            self._finish(goal, message.status, message.result)

    def _finish(self, goal: _Goal, status: GoalStatus, result: Any) -> None:
        with self._lock:
            if goal.done.is_set():
                return
            skipped = not goal.is_active and status.status in {
                GoalStatus.SUCCEEDED,
                GoalStatus.ABORTED,
                GoalStatus.PREEMPTED,
            }
            goal.is_active = goal.is_active or skipped
            goal.status, goal.result = status, result
        if skipped and goal.on_active is not None:
            self._call(goal.on_active)
        if goal.on_done is not None:
            self._call(
                goal.on_done, self.get_state() if goal is self._goal else status.status, result
            )
        goal.done.set()

    def _call(self, callback: Callable[..., object], *arguments: Any) -> None:
        try:
            callback(*arguments)
        except (Exception, SystemExit) as error:  # noqa: BLE001  # the callback boundary
            self._node.log.report(f"callback of action '{self.ns}' failed", error)
