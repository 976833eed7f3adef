"""smach_ros: states for topics, services and actions, and introspection (ROS wiki, smach_ros).

Importing it makes smach write to rospy's log, and end with the node.
"""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable, Iterable
from typing import Any

from rosz.ros1.client import rospy
from rosz.ros1.client.rospy import core
from rosz.ros1.libraries import smach
from rosz.ros1.libraries.smach import Container, State, has_smach_interface
from rosz.ros1.libraries.smach.container import run_user_code
from rosz.ros1.libraries.smach_ros.action_server_wrapper import ActionServerWrapper
from rosz.ros1.libraries.smach_ros.callback_states import ServiceState, SimpleActionState
from rosz.ros1.libraries.smach_ros.introspection import IntrospectionClient, IntrospectionServer

smach.set_loggers(rospy.loginfo, rospy.logwarn, rospy.logdebug, rospy.logerr)
smach.set_shutdown_check(rospy.is_shutdown)

_CHECK_PERIOD = 0.1
"""Seconds after which a wait looks at the shutdown of the node, or at a container."""

_LOG_PERIOD = 1.0


class RosState(State):
    """Base class of states that use a node.

    Args:
        node: The node.
        kwargs: Arguments of ``smach.State``.
    """

    def __init__(self, node: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._node = node

    @property
    def node(self) -> Any:
        """The node."""
        return self._node


class ConditionState(State):
    """Check a condition until it holds; the outcomes are ``true``, ``false`` and ``preempted``.

    Args:
        cond_cb: Function called with the user data, which returns whether it holds.
        input_keys: Keys that it reads.
        poll_rate: Duration between two checks; 0.05 s when not given.
        timeout: Duration after which the outcome is ``false``; none when not given.
        max_checks: Number of further checks after the first; -1 for no end.
    """

    def __init__(
        self,
        cond_cb: Callable[[Any], Any],
        input_keys: Iterable[str] = (),
        poll_rate: Any = None,
        timeout: Any = None,
        max_checks: int = 1,
    ) -> None:
        super().__init__(("true", "false", "preempted"), input_keys)
        if has_smach_interface(cond_cb):
            declared: Any = cond_cb
            self.register_input_keys(declared.get_registered_input_keys())
            self.register_output_keys(declared.get_registered_output_keys())
        self._cond_cb = cond_cb
        self._poll_rate = rospy.Duration.from_sec(0.05) if poll_rate is None else poll_rate
        self._timeout = timeout
        self._max_checks = max_checks

    def execute(self, ud: Any) -> str:
        """Check the condition.

        Raises:
            InvalidUserCodeError: The function failed.
        """
        began = rospy.Time.now()
        checks = 0
        while self._max_checks == -1 or checks <= self._max_checks:
            if self._timeout and rospy.Time.now() - began > self._timeout:
                break
            if self.preempt_requested():
                self.service_preempt()
                return "preempted"
            if run_user_code(f"condition {self._cond_cb}", self._cond_cb, ud):
                return "true"
            checks += 1
            rospy.sleep(self._poll_rate)
        return "false"


class MonitorState(State):
    """Check messages; the outcomes are ``valid``, ``invalid`` and ``preempted``.

    Args:
        topic: Name of the topic.
        msg_type: Class of its messages.
        cond_cb: Function called with the user data and each message; the state is ``invalid`` as
            soon as it returns false.
        max_checks: Number of messages after which the state is ``valid``; -1 for no end.
        input_keys: Keys that the function reads.
        output_keys: Keys that the function writes.
    """

    def __init__(
        self,
        topic: str,
        msg_type: Any,
        cond_cb: Callable[[Any, Any], Any],
        max_checks: int = -1,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
    ) -> None:
        super().__init__(("valid", "invalid", "preempted"), input_keys, output_keys)
        self._topic, self._msg_type = topic, msg_type
        self._cond_cb = cond_cb
        self._max_checks = max_checks
        self._n_checks = 0
        self._trigger_event = threading.Event()

    def execute(self, ud: Any) -> str:
        """Check messages until one is not valid, or all are."""
        self._n_checks = 0
        self._trigger_event.clear()
        if not self.preempt_requested():
            subscriber = rospy.Subscriber(self._topic, self._msg_type, self._check, ud)
            while not self._trigger_event.wait(_CHECK_PERIOD) and not rospy.is_shutdown():
                pass
            subscriber.unregister()
        if self.preempt_requested():
            self.service_preempt()
            return "preempted"
        return "valid" if self._is_enough() else "invalid"

    def _is_enough(self) -> bool:
        return 0 < self._max_checks <= self._n_checks

    def _check(self, message: Any, ud: Any) -> None:
        if self._trigger_event.is_set():
            return
        try:
            valid = self._cond_cb(ud, message)
        except Exception:  # noqa: BLE001  # the callback boundary
            text = traceback.format_exc()
            rospy.logerr(f"condition callback of topic '{self._topic}' failed: {text}")
            valid = False
        self._n_checks += bool(valid)
        if not valid or self._is_enough():
            self._trigger_event.set()

    def request_preempt(self) -> None:
        """Request that the state ends."""
        super().request_preempt()
        self._trigger_event.set()


def set_preempt_handler(sc: Container) -> None:
    """Preempt the outermost container when the node is shut down, and wait until it has ended."""

    def preempt() -> None:
        sc.request_preempt()
        while sc.is_running():
            rospy.loginfo_throttle(_LOG_PERIOD, "shutting down: waiting for the state machine")
            rospy.sleep(_CHECK_PERIOD)

    core.add_client_shutdown_hook(preempt)
