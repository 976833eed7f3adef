"""actionlib.server_goal_handle: a goal that an action server has received."""

from __future__ import annotations

from typing import Any

from rosz.actions import ServerGoal
from rosz.errors import EncodeError
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus
from rosz.ros1 import rospy
from rosz.ros1.exceptions import ROSSerializationException

__all__ = ("ServerGoalHandle",)


class ServerGoalHandle(ServerGoal):
    """A goal that was received; without a message a handle of no goal.

    Args:
        action_server: Its server.
        message: Message that carried it.
    """

    def __init__(self, action_server: Any = None, message: Any = None) -> None:
        if message is not None:
            super().__init__(action_server, message)
        else:
            self.server, self.message = action_server, None
            self.status, self.ended_at = GoalStatus(), 0

    @property
    def goal(self) -> Any:
        """The message that carried the goal; None for no goal."""
        return self.message

    @property
    def action_server(self) -> Any:
        """The server of the goal."""
        return self.server

    def get_default_result(self) -> Any:
        """Return an empty result message."""
        return self.server.types.result()

    def set_accepted(self, text: str = "") -> None:
        """Begin to execute the goal."""
        if self._is_set():
            self.accept(text)

    def set_canceled(self, result: Any = None, text: str = "") -> None:
        """End the goal as recalled or preempted."""
        if self._is_set():
            self.cancel(result, text)

    def set_rejected(self, result: Any = None, text: str = "") -> None:
        """End the goal before it is accepted."""
        if self._is_set():
            self.reject(result, text)

    def set_aborted(self, result: Any = None, text: str = "") -> None:
        """End the goal as failed."""
        if self._is_set():
            self.abort(result, text)

    def set_succeeded(self, result: Any = None, text: str = "") -> None:
        """End the goal as reached."""
        if self._is_set():
            self.succeed(result, text)

    def set_cancel_requested(self) -> bool:
        """Note that a client wants the goal to end; return whether that is possible and new."""
        return self.message is not None and self.request_cancel()

    def publish_feedback(self, feedback: Any) -> None:
        """Publish feedback about the goal.

        Raises:
            ROSSerializationException: The feedback is not one of the action.
        """
        if self._is_set():
            try:
                super().publish_feedback(feedback)
            except EncodeError as error:
                raise ROSSerializationException(str(error)) from error

    def get_goal(self) -> Any:
        """Return the goal; None for no goal."""
        return None if self.message is None else self.message.goal

    def get_goal_id(self) -> GoalID:
        """Return the identification of the goal; an empty one for no goal."""
        return self.id if self._is_set() else GoalID()

    def get_goal_status(self) -> GoalStatus:
        """Return the state of the goal; an empty one for no goal."""
        return self.status if self._is_set() else GoalStatus()

    def _is_set(self) -> bool:
        if self.message is None:
            rospy.logerr("a goal handle without a goal was used")
        return self.message is not None

    def _end(self, *how: Any) -> None:
        try:
            super()._end(*how)
        except EncodeError as error:
            raise ROSSerializationException(str(error)) from error

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ServerGoalHandle) or self.goal is None or other.goal is None:
            return False
        return self.id.id == other.id.id

    def __hash__(self) -> int:
        return hash(self.id.id)
