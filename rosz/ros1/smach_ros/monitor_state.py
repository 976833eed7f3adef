"""smach_ros.monitor_state: a state that checks the messages of a topic."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable, Iterable
from typing import Any

from rosz.ros1 import rospy
from rosz.ros1.smach import State

__all__ = ("MonitorState",)

_CHECK_PERIOD = 0.1
"""Seconds after which a wait looks whether the node is shut down."""


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
