"""smach_ros.simple_action_state: a state that sends a goal to an action server."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from typing import Any

from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.ros1 import rospy
from rosz.ros1.actionlib import SimpleActionClient
from rosz.ros1.smach import InvalidStateError, State
from rosz.ros1.smach_ros.user_callback import (
    CallbackFailed,
    UserCallback,
    copy_from,
    copy_to,
    fill,
)

__all__ = ("SimpleActionState",)

_CHECK_PERIOD = 0.1
"""Seconds after which a wait looks at the time limits."""

_ONE_MINUTE = 60.0


class SimpleActionState(State):
    """Send a goal; the outcomes are ``succeeded``, ``aborted`` and ``preempted``.

    Args:
        action_name: Name of the action.
        action_spec: Class of the action.
        goal: Goal to begin with.
        goal_key: Key of the goal in the user data.
        goal_slots: Fields of the goal to set from user data of the same keys.
        goal_cb: Function called with the user data and the goal, which may return another.
        goal_cb_args: Further arguments of it.
        goal_cb_kwargs: Further keyword arguments of it.
        result_key: Key for the result in the user data.
        result_slots: Fields of the result to copy to user data of the same keys.
        result_cb: Function called with the user data, the final state and the result, which may
            return an outcome.
        result_cb_args: Further arguments of it.
        result_cb_kwargs: Further keyword arguments of it.
        input_keys: Further keys that the functions read.
        output_keys: Further keys that the functions write.
        outcomes: Further outcomes.
        exec_timeout: Duration after which the goal is cancelled; none when not given.
        preempt_timeout: Longest time to wait for the end of a cancelled goal; one minute when not
            given.
        server_wait_timeout: Longest time to wait for the server; one minute when not given.

    Raises:
        InvalidStateError: A function is not callable, or a field does not exist.
    """

    WAITING_FOR_SERVER = 0
    INACTIVE = 1
    ACTIVE = 2
    PREEMPTING = 3
    COMPLETED = 4

    def __init__(  # noqa: PLR0917  # smach's
        self,
        action_name: str,
        action_spec: Any,
        goal: Any = None,
        goal_key: str | None = None,
        goal_slots: Iterable[str] = (),
        goal_cb: Callable[..., Any] | None = None,
        goal_cb_args: Sequence[Any] = (),
        goal_cb_kwargs: Mapping[str, Any] | None = None,
        result_key: str | None = None,
        result_slots: Iterable[str] = (),
        result_cb: Callable[..., Any] | None = None,
        result_cb_args: Sequence[Any] = (),
        result_cb_kwargs: Mapping[str, Any] | None = None,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        outcomes: Iterable[str] = (),
        exec_timeout: Any = None,
        preempt_timeout: Any = None,
        server_wait_timeout: Any = None,
    ) -> None:
        super().__init__(("succeeded", "aborted", "preempted", *outcomes), input_keys, output_keys)
        minute = rospy.Duration.from_sec(_ONE_MINUTE)
        self._action_name, self._action_spec = action_name, action_spec
        self._exec_timeout = exec_timeout
        self._preempt_timeout = preempt_timeout or minute
        self._server_wait_timeout = server_wait_timeout or minute
        if goal is not None and callable(goal):
            raise InvalidStateError("the goal of an action state is a function: use goal_cb")
        whole = action_spec()
        self._goal = copy(whole.action_goal.goal) if goal is None else goal
        self._goal_key = goal_key
        self._goal_slots = _checked(goal_slots, whole.action_goal.goal)
        keys = tuple(input_keys), tuple(output_keys)
        self._goal_cb = UserCallback(self, goal_cb, goal_cb_args, goal_cb_kwargs, keys)
        self._result_key = result_key
        self._result_slots = _checked(result_slots, whole.action_result.result)
        self._result_cb = UserCallback(self, result_cb, result_cb_args, result_cb_kwargs, keys)
        self.register_input_keys((*self._goal_slots, *([goal_key] if goal_key else [])))
        self.register_output_keys((*self._result_slots, *([result_key] if result_key else [])))
        self._status = self.WAITING_FOR_SERVER
        self._goal_status = GoalStatus.PENDING
        self._goal_result: Any = None
        self._done = threading.Event()
        self._action_client = SimpleActionClient(action_name, action_spec)

    def request_preempt(self) -> None:
        """Request that the state ends; an active goal is cancelled."""
        rospy.loginfo(f"Preempt requested on action '{self._action_name}'")
        super().request_preempt()
        if self._status == self.ACTIVE:
            self._action_client.cancel_goal()

    def execute(self, ud: Any) -> Any:
        """Send the goal, and wait for its end."""
        connected = self._connect()
        if self.preempt_requested():
            self.service_preempt()
            return "preempted"
        if not connected:
            rospy.logfatal(f"Action server for {self._action_name} is not running.")
            return "aborted"
        try:
            self._prepare(ud)
            self._send()
            return self._finish(ud)
        except CallbackFailed:
            return "aborted"
        finally:
            self._status = self.INACTIVE

    def _connect(self) -> bool:
        """Wait for the server; return False if there is none, or the state is preempted."""
        limit = rospy.Time.now() + self._server_wait_timeout
        while self._status == self.WAITING_FOR_SERVER:
            if self.preempt_requested() or rospy.is_shutdown() or rospy.Time.now() >= limit:
                return False
            if self._action_client.wait_for_server(rospy.Duration(1)):
                self._status = self.INACTIVE
            else:
                rospy.logwarn(f"Still waiting for action server '{self._action_name}'...")
        return True

    def _prepare(self, ud: Any) -> None:
        if self._goal_key is not None:
            self._goal = copy_from(ud, self._goal_key)
        fill(self._goal, ud, self._goal_slots)
        what = f"goal callback of action '{self._action_name}'"
        changed = self._goal_cb.call(what, ud, self._goal)
        if changed is not None:
            self._goal = changed

    def _send(self) -> None:
        """Send the goal; return when it has ended, or did not in time after a cancellation."""
        self._done.clear()
        self._goal_status, self._goal_result = GoalStatus.LOST, None
        began = rospy.Time.now()
        cancelled: Any = None
        self._status = self.ACTIVE
        self._action_client.send_goal(self._goal, self._end)
        if self.preempt_requested():  # before there was a goal to cancel
            self._action_client.cancel_goal()
        while not self._done.wait(_CHECK_PERIOD) and not rospy.is_shutdown():
            now = rospy.Time.now()
            if cancelled is None and self.preempt_requested():
                cancelled = now
            if cancelled is None and self._exec_timeout and now - began > self._exec_timeout:
                seconds = self._exec_timeout.to_sec()
                rospy.logwarn(f"Action {self._action_name} timed out after {seconds:g} seconds.")
                self._action_client.cancel_goal()
                cancelled = now
            if cancelled is not None and now - cancelled > self._preempt_timeout:
                rospy.logwarn(f"Action {self._action_name} did not end when it was cancelled.")
                self._action_client.stop_tracking_goal()
                return

    def _end(self, status: int, result: Any) -> None:
        self._goal_status, self._goal_result = status, result
        self._done.set()

    def _finish(self, ud: Any) -> Any:
        what = f"result callback of action '{self._action_name}'"
        chosen = self._result_cb.choose(what, ud, self._goal_status, self._goal_result)
        copy_to(ud, self._goal_result, self._result_key, self._result_slots)
        outcome = "aborted"
        if self._goal_status == GoalStatus.SUCCEEDED:
            outcome = "succeeded"
        elif self.preempt_requested():
            self.service_preempt()
            if self._goal_status in {GoalStatus.PREEMPTED, GoalStatus.LOST}:
                outcome = "preempted"
        return outcome if chosen is None else chosen


def _checked(slots: Iterable[str], message: Any) -> tuple[str, ...]:
    found = tuple(slots)
    known = message.__slots__
    for slot in found:
        if slot not in known:
            name = type(message).__name__
            raise InvalidStateError(f"{name} has no field '{slot}'; it has {list(known)}")
    return found
