"""Goals of actions as ROS 2 knows them: their states, and the names of an action's entities.

An action has three services and two topics below its name (ROS 2 design, "Actions").
"""

from __future__ import annotations

from enum import IntEnum

__all__ = (
    "CANCEL",
    "FEEDBACK",
    "FINAL",
    "RESULT",
    "SEND",
    "STATUS",
    "GoalState",
    "may_become",
)

SEND = "_action/send_goal"
CANCEL = "_action/cancel_goal"
RESULT = "_action/get_result"
FEEDBACK = "_action/feedback"
STATUS = "_action/status"


class GoalState(IntEnum):
    """The states of a goal, with the numbers of ``action_msgs/GoalStatus``."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @property
    def text(self) -> str:
        """The state as a word, such as ``executing``."""
        return self.name.lower()


FINAL = frozenset({GoalState.SUCCEEDED, GoalState.CANCELED, GoalState.ABORTED})
"""States that a goal never leaves."""

_NEXT = {
    GoalState.ACCEPTED: {GoalState.EXECUTING, GoalState.CANCELING},
    GoalState.EXECUTING: {GoalState.CANCELING, GoalState.SUCCEEDED, GoalState.ABORTED},
    GoalState.CANCELING: FINAL,
}


def may_become(state: GoalState, after: GoalState) -> bool:
    """Return whether a goal may go from one state to another."""
    return after in _NEXT.get(state, ())
