"""actionlib.simple_action_server: executing one goal at a time (ROS wiki, actionlib)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rosz import actions
from rosz.ros1.actionlib.action_server import ActionServer, nop_cb
from rosz.ros1.actionlib.server_goal_handle import ServerGoalHandle

__all__ = ("SimpleActionServer",)


class SimpleActionServer(actions.SimpleActionServer):
    """Execute one goal at a time; a newer goal preempts the current one.

    Args:
        name: Name of the action.
        ActionSpec: Class of the action, such as ``DoAction``.
        execute_cb: Function called with each goal on a thread of its own. It must end with
            `set_succeeded`, `set_aborted` or `set_preempted`. Without one, use
            `register_goal_callback` and `accept_new_goal`.
        auto_start: Whether the server starts at once, and not with `start`.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
        ActionException: The class is not that of an action.
    """

    def __init__(
        self,
        name: str,
        ActionSpec: type[Any],  # noqa: N803  # ROS 1's
        execute_cb: Callable[[Any], object] | None = None,
        auto_start: bool = True,
    ) -> None:
        super().__init__(ActionServer(name, ActionSpec, nop_cb, nop_cb, False), execute_cb)
        self.current_goal = ServerGoalHandle()
        self.next_goal = ServerGoalHandle()
        if auto_start:
            self.start()

    def register_goal_callback(self, cb: Callable[[], object]) -> None:
        """Call a function when there is a new goal to accept."""
        if self.execute_callback is not None:
            self.action_server.node.log.warning(
                "register_goal_callback() has no effect: the server has an execute callback"
            )
        else:
            self.on_goal = cb

    def register_preempt_callback(self, cb: Callable[[], object]) -> None:
        """Call a function when the goal is asked to end."""
        self.on_preempt = cb
