"""actionlib.handle_tracker_deleter: notes when nobody refers to a goal any more."""

from __future__ import annotations

from typing import Any

from rosz.ros1 import rospy

__all__ = ("HandleTrackerDeleter",)


class HandleTrackerDeleter:
    """Function that notes the end of a goal.

    Args:
        action_server: Server of the goal.
        status_tracker: State of the goal.
    """

    def __init__(self, action_server: Any, status_tracker: Any) -> None:
        self.action_server: Any = action_server
        self.status_tracker: Any = status_tracker

    def __call__(self, ptr: Any) -> None:  # noqa: ARG002
        """Note the time."""
        if self.action_server:
            with self.action_server.lock:
                self.status_tracker.handle_destruction_time = rospy.Time.now()
