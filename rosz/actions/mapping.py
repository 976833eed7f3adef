"""Translate states of goals and messages between the actions of ROS 1 and of ROS 2.

ROS 2 has one state for a goal that is to end, whether it was executed or not, and one for a goal
that has ended so. A goal that the server rejects is never accepted there.
"""

from __future__ import annotations

from typing import TypeVar

from rosz.message import Message
from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.node.goals import GoalState

__all__ = ("STATES", "STATUSES", "translate")

M = TypeVar("M", bound=Message)

STATUSES = {
    GoalState.UNKNOWN: GoalStatus.LOST,
    GoalState.ACCEPTED: GoalStatus.PENDING,
    GoalState.EXECUTING: GoalStatus.ACTIVE,
    GoalState.CANCELING: GoalStatus.PREEMPTING,
    GoalState.SUCCEEDED: GoalStatus.SUCCEEDED,
    GoalState.CANCELED: GoalStatus.PREEMPTED,
    GoalState.ABORTED: GoalStatus.ABORTED,
}
"""The state of ROS 1 for each of ROS 2."""

STATES = {
    GoalStatus.PENDING: GoalState.ACCEPTED,
    GoalStatus.ACTIVE: GoalState.EXECUTING,
    GoalStatus.RECALLING: GoalState.CANCELING,
    GoalStatus.PREEMPTING: GoalState.CANCELING,
    GoalStatus.SUCCEEDED: GoalState.SUCCEEDED,
    GoalStatus.RECALLED: GoalState.CANCELED,
    GoalStatus.PREEMPTED: GoalState.CANCELED,
    GoalStatus.ABORTED: GoalState.ABORTED,
    GoalStatus.REJECTED: GoalState.ABORTED,  # if it was accepted before
}
"""The state of ROS 2 for each of ROS 1 that a server sets."""


def translate(message: Message, cls: type[M]) -> M:
    """Return a message of another class of the same fields."""
    return cls(**{name: getattr(message, name) for name in cls.__struct_fields__})
