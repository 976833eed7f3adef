"""The states of goals in both protocols, and the names of an action's services and topics.

ROS 2 has one state for a goal that is to end, whether it was executed or not, and one for a goal
that has ended so; actionlib has two of each. A goal that actionlib's server rejects is never
accepted in ROS 2 (ROS 2 design, "Actions"; ROS wiki, actionlib/DetailedDescription).
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum

SEND = "_action/send_goal"
CANCEL = "_action/cancel_goal"
RESULT = "_action/get_result"
FEEDBACK = "_action/feedback"
STATUS = "_action/status"


class _State(IntEnum):
    @property
    def text(self) -> str:
        """The state as a word, such as ``executing``."""
        return self.name.lower()


class GoalState(_State):
    """The states of a goal by ROS 2, with the numbers of ``action_msgs/GoalStatus``."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


class ActionlibState(_State):
    """The states of a goal by actionlib, with the numbers of ``actionlib_msgs/GoalStatus``."""

    PENDING = 0
    ACTIVE = 1
    PREEMPTED = 2
    SUCCEEDED = 3
    ABORTED = 4
    REJECTED = 5
    PREEMPTING = 6
    RECALLING = 7
    RECALLED = 8
    LOST = 9


_G, _A = GoalState, ActionlibState
FINAL = frozenset({_G.SUCCEEDED, _G.CANCELED, _G.ABORTED})
"""States of ROS 2 that a goal never leaves."""

# Each state of ROS 2: which states may follow, and actionlib's states for it. The first of these
# stands for it; a goal that was accepted in ROS 2 and then rejected has no better state there.
_TABLE: Mapping[GoalState, tuple[frozenset[GoalState], tuple[ActionlibState, ...]]] = {
    _G.UNKNOWN: (frozenset(), (_A.LOST,)),
    _G.ACCEPTED: (frozenset({_G.EXECUTING, _G.CANCELING}), (_A.PENDING,)),
    _G.EXECUTING: (frozenset({_G.CANCELING, _G.SUCCEEDED, _G.ABORTED}), (_A.ACTIVE,)),
    _G.CANCELING: (FINAL, (_A.PREEMPTING, _A.RECALLING)),
    _G.SUCCEEDED: (frozenset(), (_A.SUCCEEDED,)),
    _G.CANCELED: (frozenset(), (_A.PREEMPTED, _A.RECALLED)),
    _G.ABORTED: (frozenset(), (_A.ABORTED, _A.REJECTED)),
}
TO_ACTIONLIB = {state: int(states[0]) for state, (_, states) in _TABLE.items()}
"""The state of actionlib for each of ROS 2."""
TO_ROS2 = {int(old): state for state, (_, states) in _TABLE.items() for old in states}
"""The state of ROS 2 for each of actionlib."""

RUNNING = frozenset({_A.ACTIVE, _A.PREEMPTING})
"""States of actionlib in which the server executes a goal."""
TERMINAL = frozenset({
    _A.PREEMPTED, _A.SUCCEEDED, _A.ABORTED, _A.REJECTED, _A.RECALLED, _A.LOST,
})  # fmt: skip
"""States of actionlib that a goal never leaves."""

_WAITING, _EXECUTED = (_A.PENDING, _A.RECALLING), (_A.ACTIVE, _A.PREEMPTING)
ACTIONLIB_STEPS: Mapping[str, Mapping[ActionlibState, ActionlibState]] = {
    "accept": {_A.PENDING: _A.ACTIVE, _A.RECALLING: _A.PREEMPTING},
    "request_cancel": {_A.PENDING: _A.RECALLING, _A.ACTIVE: _A.PREEMPTING},
    "cancel": dict.fromkeys(_WAITING, _A.RECALLED) | dict.fromkeys(_EXECUTED, _A.PREEMPTED),
    "reject": dict.fromkeys(_WAITING, _A.REJECTED),
    "abort": dict.fromkeys(_EXECUTED, _A.ABORTED),
    "succeed": dict.fromkeys(_EXECUTED, _A.SUCCEEDED),
}
"""The states of actionlib before and after each step of a server."""


def may_become(state: GoalState, after: GoalState) -> bool:
    """Return whether a goal may go from one state of ROS 2 to another."""
    return after in _TABLE[state][0]
