"""Serving goals."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.std_msgs.msg import Header
from rosz.node import Node
from rosz.qos import QoS
from rosz.ros1 import state
from rosz.ros1.actionlib.types import TERMINAL, ActionTypes

__all__ = ("SimpleActionServer",)

_STATUS_PERIOD = 0.2
_REMEMBERED = 5 * 10**9
"""Nanoseconds for which the state of a goal that is over is still told."""

_SUPERSEDED = "This goal was canceled because another goal was received by the simple action server"
_QUEUE = QoS(depth=50)


class _Goal:
    """A goal that was received."""

    def __init__(self, message: Any, now: int) -> None:
        stamp = message.goal_id.stamp
        self.id = GoalID(stamp, message.goal_id.id)
        self.goal = message.goal
        self.status = GoalStatus(self.id, GoalStatus.PENDING)
        self.over_since = 0
        self.cancelled = False
        self.order = stamp.to_nsec() or now

    def get_goal(self) -> Any:
        """Return what is to be done."""
        return self.goal

    def get_goal_id(self) -> GoalID:
        """Return what identifies it."""
        return self.id

    def get_goal_status(self) -> GoalStatus:
        """Return its state."""
        return self.status


class SimpleActionServer:
    """Works on one goal at a time; a newer one asks the older to give way.

    Args:
        name: Name of the action.
        ActionSpec: Its class, ``DoAction``.
        execute_cb: Gets each goal on a thread of its own, and ends with `set_succeeded`,
            `set_aborted` or `set_preempted`. Without one, `register_goal_callback` and
            `accept_new_goal` do.
        auto_start: Whether it begins at once, and not with `start`.

    Raises:
        ROSInitException: The process is no node yet.
        UsageError: The class is none of an action.
    """

    def __init__(
        self,
        name: str,
        ActionSpec: type[Any],  # noqa: N803  # ROS 1's
        execute_cb: Callable[[Any], object] | None = None,
        auto_start: bool = True,
    ) -> None:
        self._types = ActionTypes.of(ActionSpec)
        self._node: Node = state.node()
        self.name = self._node.resolve(name)
        self.execute_callback = execute_cb
        self.current_goal: _Goal | None = None
        self.next_goal: _Goal | None = None
        self._goals: dict[str, _Goal] = {}
        self._changed = threading.Condition(threading.RLock())
        self._goal_callback: Callable[[], object] | None = None
        self._preempt_callback: Callable[[], object] | None = None
        self._publishers: dict[str, Any] = {}
        if auto_start:
            self.start()

    def start(self) -> None:
        """Begin to take goals."""
        node, types = self._node, self._types
        kinds: dict[str, type[Any]] = {
            "status": GoalStatusArray,
            "result": types.action_result,
            "feedback": types.action_feedback,
        }
        self._publishers = {
            topic: node.publisher(f"{self.name}/{topic}", kind, qos=_QUEUE)
            for topic, kind in kinds.items()
        }
        node.subscription(f"{self.name}/cancel", GoalID, self._on_cancel, qos=_QUEUE)
        node.subscription(f"{self.name}/goal", types.action_goal, self._on_goal, qos=_QUEUE)
        node.timer(_STATUS_PERIOD, lambda _: self._tell_status())
        if self.execute_callback is not None:
            threading.Thread(
                target=self._work, args=(self.execute_callback,), name=f"rosz-action{self.name}",
                daemon=True,
            ).start()  # fmt: skip
        node.on_shutdown(lambda _: self._wake())

    def register_goal_callback(self, cb: Callable[[], object]) -> None:
        """Have a function called when there is a new goal to accept."""
        if self.execute_callback is not None:
            self._node.log.warning(
                "Cannot call SimpleActionServer.register_goal_callback() because an executeCallback"
                " exists. Not going to register it."
            )
        else:
            self._goal_callback = cb

    def register_preempt_callback(self, cb: Callable[[], object]) -> None:
        """Have a function called when the goal is asked to give way."""
        self._preempt_callback = cb

    def is_new_goal_available(self) -> bool:
        """Tell whether there is a goal to accept."""
        return self.next_goal is not None

    def is_preempt_requested(self) -> bool:
        """Tell whether the goal is asked to give way: it was cancelled, or a newer one is there."""
        with self._changed:
            goal = self.current_goal
            return goal is not None and (goal.cancelled or self.next_goal is not None)

    def is_active(self) -> bool:
        """Tell whether there is a goal that is being worked on."""
        goal = self.current_goal
        return goal is not None and goal.status.status in {
            GoalStatus.ACTIVE,
            GoalStatus.PREEMPTING,
        }

    def accept_new_goal(self) -> Any:
        """Begin to work on the goal that waits; what was worked on until now is given up.

        Returns:
            The goal; None if there is none.
        """
        with self._changed:
            goal = self.next_goal
            if goal is None:
                self._node.log.error("Attempting to accept the next goal when one is not available")
                return None
            if self.is_active():
                self.set_preempted(text=_SUPERSEDED)
            self.current_goal, self.next_goal = goal, None
            goal.status.status = GoalStatus.PREEMPTING if goal.cancelled else GoalStatus.ACTIVE
            goal.status.text = "This goal has been accepted by the simple action server"
        self._tell_status()
        return goal.goal

    def set_succeeded(self, result: Any = None, text: str = "") -> None:
        """End the goal: it is reached."""
        self._end_current(GoalStatus.SUCCEEDED, result, text)

    def set_aborted(self, result: Any = None, text: str = "") -> None:
        """End the goal: it cannot be reached."""
        self._end_current(GoalStatus.ABORTED, result, text)

    def set_preempted(self, result: Any = None, text: str = "") -> None:
        """End the goal: it has given way."""
        self._end_current(GoalStatus.PREEMPTED, result, text)

    def publish_feedback(self, feedback: Any) -> None:
        """Tell how the goal is coming on."""
        goal = self.current_goal
        if goal is None:
            self._node.log.error("Attempting to publish feedback while there is no goal")
            return
        message = self._types.action_feedback(self._header(), goal.status, feedback)
        self._publishers["feedback"].publish(message)

    def get_default_result(self) -> Any:
        """Return an empty result."""
        return self._types.result()

    def _header(self) -> Header:
        return Header(stamp=Time(*divmod(self._node.now(), 10**9)))

    def _wake(self) -> None:
        with self._changed:
            self._changed.notify_all()

    def _on_goal(self, message: Any) -> None:
        with self._changed:
            if message.goal_id.id in self._goals:
                return  # cancelled before it came, or sent twice
            goal = _Goal(message, self._node.now())
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
        self._tell_status()
        if preempts:
            self._call(self._preempt_callback)
        self._call(self._goal_callback)

    def _on_cancel(self, message: GoalID) -> None:
        until = message.stamp.to_nsec()
        everything = not message.id and not until
        with self._changed:
            hit = [
                goal
                for goal in self._goals.values()
                if goal.status.status not in TERMINAL
                and (everything or goal.id.id == message.id or (until and goal.order <= until))
            ]
            for goal in hit:
                goal.cancelled = True
                active = goal.status.status == GoalStatus.ACTIVE
                goal.status.status = GoalStatus.PREEMPTING if active else GoalStatus.RECALLING
            current = any(goal is self.current_goal for goal in hit)
            self._changed.notify_all()
        self._tell_status()
        if current:
            self._call(self._preempt_callback)

    def _end_current(self, status: int, result: Any, text: str) -> None:
        with self._changed:
            goal = self.current_goal
            if goal is None or goal.status.status in TERMINAL:
                self._node.log.error(
                    "To transition to a terminal state, the goal must be active; there is none"
                )
                return
            self._end(goal, status, result, text)

    def _end(self, goal: _Goal, status: int, result: Any, text: str) -> None:
        goal.status.status, goal.status.text = status, text
        goal.over_since = self._node.now()
        outcome = self._types.result() if result is None else result
        message = self._types.action_result(self._header(), goal.status, outcome)
        self._publishers["result"].publish(message)
        self._tell_status()

    def _tell_status(self) -> None:
        with self._changed:
            now = self._node.now()
            self._goals = {
                name: goal
                for name, goal in self._goals.items()
                if not goal.over_since or now - goal.over_since < _REMEMBERED
            }
            statuses = [goal.status for goal in self._goals.values()]
            self._publishers["status"].publish(GoalStatusArray(self._header(), statuses))

    def _work(self, execute: Callable[[Any], object]) -> None:
        node = self._node
        while not node.is_shutdown:
            with self._changed:
                if self.next_goal is None:
                    self._changed.wait(_STATUS_PERIOD)
                    continue
                goal = self.accept_new_goal()
            try:
                execute(goal)
            except (Exception, SystemExit) as error:  # noqa: BLE001  # the callback boundary
                if node.is_shutdown:
                    return
                node.log.report("Exception in your execute callback", error)
                if self.is_active():
                    self.set_aborted(None, f"Exception in execute callback: {error}")
                continue
            if self.is_active() and not node.is_shutdown:
                node.log.warning(
                    "Your executeCallback did not set the goal to a terminal status. This is a bug"
                    " in your ActionServer implementation. Fix your code! For now, the ActionServer"
                    " will set this goal to aborted"
                )
                self.set_aborted(None, "No terminal state was set.")

    def _call(self, callback: Callable[[], object] | None) -> None:
        if callback is None:
            return
        try:
            callback()
        except (Exception, SystemExit) as error:  # noqa: BLE001  # the callback boundary
            self._node.log.report(f"callback of action '{self.name}' failed", error)
