"""actionlib.action_server: receiving goals (ROS wiki, actionlib)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rosz import actions, names
from rosz.ros1 import rospy, state
from rosz.ros1.actionlib.server_goal_handle import ServerGoalHandle

__all__ = ("ActionServer", "nop_cb")

_QUEUE_SIZE = 50
_FREQUENCY = 5.0
_TIMEOUT = 5.0


def nop_cb(goal_handle: Any) -> None:
    """Do nothing with a goal."""


class ActionServer(actions.ActionServer):
    """Receive goals, and publish what becomes of them.

    Args:
        ns: Name of the action.
        ActionSpec: Class of the action, such as ``DoAction``.
        goal_cb: Function called with the handle of each goal that arrives.
        cancel_cb: Function called with the handle of each goal that is requested to end.
        auto_start: Whether the server starts at once, and not with `start`.

    Attributes:
        ns: As given.
        ActionSpec: As given.
        ActionGoal: Class of the messages that carry goals.
        ActionResult: Class of the messages that carry results.
        ActionFeedback: Class of the messages that carry feedback.
        ActionResultType: Class of the results.
        started: Whether the server receives goals.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
        ActionException: The class is not that of an action.
    """

    _goal_class = ServerGoalHandle

    def __init__(
        self,
        ns: str,
        ActionSpec: type[Any],  # noqa: N803  # ROS 1's
        goal_cb: Callable[[Any], object],
        cancel_cb: Callable[[Any], object] = nop_cb,
        auto_start: bool = True,
    ) -> None:
        node = state.node()
        super().__init__(node, names.canonical(ns), ActionSpec, goal_cb, cancel_cb)
        queue_size = int(rospy.get_param("actionlib_server_pub_queue_size", _QUEUE_SIZE))
        self.queue_size = _QUEUE_SIZE if queue_size < 0 else queue_size
        found = rospy.search_param("actionlib_status_frequency")
        frequency = _FREQUENCY if found is None else rospy.get_param(found, _FREQUENCY)
        self.status_frequency = float(rospy.get_param(f"{self.name}/status_frequency", frequency))
        self.status_timeout = float(rospy.get_param(f"{self.name}/status_list_timeout", _TIMEOUT))
        self.ns: str = ns
        self.ActionSpec: type[Any] = ActionSpec
        self.ActionGoal: type[Any] = self.types.action_goal
        self.ActionResult: type[Any] = self.types.action_result
        self.ActionFeedback: type[Any] = self.types.action_feedback
        self.ActionResultType: type[Any] = self.types.result
        self.started: bool = False
        if auto_start:
            self.start()

    @property
    def status_list(self) -> list[Any]:
        """The goals whose states are published."""
        return self.goals

    def start(self) -> None:
        """Begin to receive goals; a started server does nothing."""
        super().start()
        self.started = True

    def stop(self) -> None:
        """Stop receiving goals; a server that is not started does nothing."""
        self.started = False
        super().stop()

    def register_goal_callback(self, cb: Callable[[Any], object]) -> None:
        """Replace the function that is called with goals."""
        self.on_goal = cb

    def register_cancel_callback(self, cancel_cb: Callable[[Any], object]) -> None:
        """Replace the function that is called with goals that are requested to end."""
        self.on_cancel = cancel_cb
