"""smach_ros: states that call services and actions.

Functions of the program make the requests of user data, and put the responses into it.
"""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from typing import Any

from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.ros1.client import rospy
from rosz.ros1.client.actionlib import SimpleActionClient
from rosz.ros1.libraries.smach import InvalidStateError, Remapper, State, has_smach_interface


class _CallbackFailed(Exception):
    """A function of the program failed, or user data lacks a key; the log has the reason."""


class _UserCallback:
    """A function that sees the user data of a state, which gets its keys and outcomes.

    Keys are the input and output keys of a function that declares none.
    """

    def __init__(
        self,
        state: State,
        function: Callable[..., Any] | None,
        args: Sequence[Any] = (),
        kwargs: Mapping[str, Any] | None = None,
        keys: tuple[Iterable[str], Iterable[str]] = ((), ()),
    ) -> None:
        if function is not None and not callable(function):
            raise InvalidStateError(f"{function!r} is not callable")
        self._state = state
        self._function = function
        self._args = args
        self._kwargs = kwargs or {}
        self._inputs, self._outputs = map(tuple, keys)
        if has_smach_interface(function):
            declared: Any = function
            self._inputs = declared.get_registered_input_keys()
            self._outputs = declared.get_registered_output_keys()
            state.register_outcomes(declared.get_registered_outcomes())
        state.register_input_keys(self._inputs)
        state.register_output_keys(self._outputs)

    def call(self, what: str, ud: Any, *given: Any) -> Any:
        """Call the function with user data; return None if there is none."""
        if self._function is None:
            return None
        seen = Remapper(ud, self._inputs, self._outputs)
        try:
            return self._function(seen, *given, *self._args, **self._kwargs)
        except Exception as error:
            rospy.logerr(f"{what} failed: {traceback.format_exc()}")
            raise _CallbackFailed from error

    def fill(self, what: str, ud: Any, message: Any, key: str | None, slots: Iterable[str]) -> Any:
        """Return a message, or the one of a key, with fields from user data and the function."""
        filled = message if key is None else _copy_from(ud, key)
        for slot in slots:
            setattr(filled, slot, _copy_from(ud, slot))
        changed = self.call(what, ud, filled)
        return filled if changed is None else changed

    def choose(self, what: str, ud: Any, *given: Any) -> Any:
        """Call the function, and return the outcome that it chooses, or None."""
        outcome = self.call(what, ud, *given)
        registered = self._state.get_registered_outcomes()
        if outcome is not None and outcome not in registered:
            rospy.logerr(f"{what} returned {outcome!r}; expected None or one of {list(registered)}")
            raise _CallbackFailed
        return outcome


def _copy_from(ud: Any, key: str) -> Any:
    """Return a value of user data, or raise a `_CallbackFailed` if it lacks the key."""
    if key not in ud:
        rospy.logerr(f"user data has no key '{key}'; it has {ud.keys()}")
        raise _CallbackFailed
    return ud[key]


def _copy_to(ud: Any, message: Any, key: str | None, slots: Iterable[str]) -> None:
    """Put a message, and fields of it under their names, into user data."""
    if key is not None:
        ud[key] = message
    if message is not None:
        for slot in slots:
            ud[slot] = getattr(message, slot)


_WAIT_PERIOD = 1.0
"""Seconds after which a wait for the service looks whether it was preempted."""


class ServiceState(State):
    """Call a service; the outcomes are ``succeeded``, ``aborted`` and ``preempted``.

    Args:
        service_name: Name of the service.
        service_spec: Class of the service.
        request: Request to begin with.
        request_cb: Function called with the user data and the request, which may return another.
        request_cb_args: Further arguments of it.
        request_cb_kwargs: Further keyword arguments of it.
        request_key: Key of the request in the user data.
        request_slots: Fields of the request to set from user data of the same keys.
        response_cb: Function called with the user data and the response, which may return an
            outcome.
        response_cb_args: Further arguments of it.
        response_cb_kwargs: Further keyword arguments of it.
        response_key: Key for the response in the user data.
        response_slots: Fields of the response to copy to user data of the same keys.
        input_keys: Further keys that the functions read.
        output_keys: Further keys that the functions write.
        outcomes: Further outcomes.

    Raises:
        InvalidStateError: A function is not callable.
    """

    def __init__(  # noqa: PLR0917  # smach's
        self,
        service_name: str,
        service_spec: Any,
        request: Any = None,
        request_cb: Callable[..., Any] | None = None,
        request_cb_args: Sequence[Any] = (),
        request_cb_kwargs: Mapping[str, Any] | None = None,
        request_key: str | None = None,
        request_slots: Iterable[str] = (),
        response_cb: Callable[..., Any] | None = None,
        response_cb_args: Sequence[Any] = (),
        response_cb_kwargs: Mapping[str, Any] | None = None,
        response_key: str | None = None,
        response_slots: Iterable[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        outcomes: Iterable[str] = (),
    ) -> None:
        super().__init__(("succeeded", "aborted", "preempted", *outcomes), input_keys, output_keys)
        self._service_name, self._service_spec = service_name, service_spec
        self._request = service_spec._request_class() if request is None else request
        self._response: Any = None
        self._proxy: Any = None
        keys = tuple(input_keys), tuple(output_keys)
        self._request_cb = _UserCallback(self, request_cb, request_cb_args, request_cb_kwargs, keys)
        self._response_cb = _UserCallback(
            self, response_cb, response_cb_args, response_cb_kwargs, keys
        )
        self._request_key, self._request_slots = request_key, tuple(request_slots)
        self._response_key, self._response_slots = response_key, tuple(response_slots)
        self.register_input_keys((*self._request_slots, *([request_key] if request_key else [])))
        self.register_output_keys(
            (*self._response_slots, *([response_key] if response_key else []))
        )

    def execute(self, ud: Any) -> Any:
        """Call the service."""
        if not self._connect():
            if self.preempt_requested():
                self.service_preempt()
                return "preempted"
            return "aborted"
        try:
            return self._call(ud)
        except _CallbackFailed:
            return "aborted"
        except rospy.ServiceException as error:
            rospy.logerr(f"service '{self._service_name}' failed: {error}")
            return "aborted"

    def _connect(self) -> bool:
        """Wait for the service; return False if preempted or shut down."""
        while self._proxy is None:
            if self.preempt_requested() or rospy.is_shutdown():
                return False
            try:
                rospy.wait_for_service(self._service_name, _WAIT_PERIOD)
            except rospy.ROSInterruptException:
                return False
            except rospy.ROSException:
                rospy.logwarn(f"Still waiting for service '{self._service_name}'...")
                continue
            self._proxy = rospy.ServiceProxy(self._service_name, self._service_spec)
        return not self.preempt_requested()

    def _call(self, ud: Any) -> Any:
        name = self._service_name
        what = f"request callback of service '{name}'"
        self._request = self._request_cb.fill(
            what, ud, self._request, self._request_key, self._request_slots
        )
        self._response = self._proxy(self._request)
        what = f"response callback of service '{name}'"
        outcome = self._response_cb.choose(what, ud, self._response)
        _copy_to(ud, self._response, self._response_key, self._response_slots)
        return "succeeded" if outcome is None else outcome


_CHECK_PERIOD = 0.1
"""Seconds after which a wait looks at the time limits."""

_ONE_MINUTE = 60.0


class SimpleActionState(State):
    """Send a goal; the outcomes are ``succeeded``, ``aborted`` and ``preempted``.

    Args:
        action_name: Name of the action.
        action_spec: Class of the action.
        goal: Goal to begin with; it and the arguments ``goal_…`` are as the request of a
            `ServiceState`.
        result_cb: Function called with the user data, the final state and the result, which may
            return an outcome; the other arguments ``result_…`` are as those of a response.
        input_keys: As for `ServiceState`, as are ``output_keys`` and ``outcomes``.
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
        self._goal_cb = _UserCallback(self, goal_cb, goal_cb_args, goal_cb_kwargs, keys)
        self._result_key = result_key
        self._result_slots = _checked(result_slots, whole.action_result.result)
        self._result_cb = _UserCallback(self, result_cb, result_cb_args, result_cb_kwargs, keys)
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
            what = f"goal callback of action '{self._action_name}'"
            self._goal = self._goal_cb.fill(what, ud, self._goal, self._goal_key, self._goal_slots)
            self._send()
            return self._finish(ud)
        except _CallbackFailed:
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
        _copy_to(ud, self._goal_result, self._result_key, self._result_slots)
        outcome = "aborted"
        if self._goal_status == GoalStatus.SUCCEEDED:
            outcome = "succeeded"
        elif self.preempt_requested():
            self.service_preempt()
            if self._goal_status in {GoalStatus.PREEMPTED, GoalStatus.LOST}:
                outcome = "preempted"
        return outcome if chosen is None else chosen


def _checked(slots: Iterable[str], message: Any) -> tuple[str, ...]:
    names = tuple(slots)
    declared = message.__slots__
    for slot in names:
        if slot not in declared:
            name = type(message).__name__
            raise InvalidStateError(f"{name} has no field '{slot}'; it has {list(declared)}")
    return names
