"""smach_ros.condition_state: a state that checks a condition."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable
from typing import Any

from rosz.ros1 import rospy
from rosz.ros1.smach import InvalidUserCodeError, State, has_smach_interface

__all__ = ("ConditionState",)


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
            if self._holds(ud):
                return "true"
            checks += 1
            rospy.sleep(self._poll_rate)
        return "false"

    def _holds(self, ud: Any) -> bool:
        try:
            return bool(self._cond_cb(ud))
        except Exception as error:
            text = traceback.format_exc()
            raise InvalidUserCodeError(f"condition {self._cond_cb} failed: {text}") from error
