"""The state of a goal in a client, and its changes by the server (ROS wiki, actionlib)."""

from __future__ import annotations

from collections.abc import Mapping

from rosz.msgs.actionlib_msgs.msg import GoalStatus


class CommState:
    """The states of a goal in a client."""

    WAITING_FOR_GOAL_ACK = 0
    PENDING = 1
    ACTIVE = 2
    WAITING_FOR_RESULT = 3
    WAITING_FOR_CANCEL_ACK = 4
    RECALLING = 5
    PREEMPTING = 6
    DONE = 7
    LOST = 8


_C, _S = CommState, GoalStatus
_RESULT = _C.WAITING_FOR_RESULT
_Paths = Mapping[int, tuple[int, ...]]
_FROM_PREEMPTING: _Paths = {
    _S.PREEMPTING: (),
    _S.PREEMPTED: (_RESULT,),
    _S.SUCCEEDED: (_RESULT,),
    _S.ABORTED: (_RESULT,),
}
_FROM_ACTIVE: _Paths = {
    **_FROM_PREEMPTING,
    _S.ACTIVE: (),
    _S.PREEMPTING: (_C.PREEMPTING,),
    _S.PREEMPTED: (_C.PREEMPTING, _RESULT),
}
_TO_ACTIVE = {status: (_C.ACTIVE, *states) for status, states in _FROM_ACTIVE.items()}
_TO_PREEMPTING = {status: (_C.PREEMPTING, *states) for status, states in _FROM_PREEMPTING.items()}
_OVER = (_S.REJECTED, _S.RECALLED, _S.PREEMPTED, _S.SUCCEEDED, _S.ABORTED)

# ROS 1's own table (actionlib/action_client.py): a state that was missed is passed through.
_PATHS: Mapping[int, _Paths] = {
    _C.WAITING_FOR_GOAL_ACK: {
        **_TO_ACTIVE,
        _S.PENDING: (_C.PENDING,),
        _S.REJECTED: (_C.PENDING, _RESULT),
        _S.RECALLING: (_C.PENDING, _C.RECALLING),
        _S.RECALLED: (_C.PENDING, _RESULT),
    },
    _C.PENDING: {
        **_TO_ACTIVE,
        _S.PENDING: (),
        _S.REJECTED: (_RESULT,),
        _S.RECALLING: (_C.RECALLING,),
        _S.RECALLED: (_C.RECALLING, _RESULT),
    },
    _C.ACTIVE: _FROM_ACTIVE,
    _RESULT: dict.fromkeys((_S.ACTIVE, *_OVER), ()),
    _C.WAITING_FOR_CANCEL_ACK: {
        **_TO_PREEMPTING,
        _S.PENDING: (),
        _S.ACTIVE: (),
        _S.REJECTED: (_RESULT,),
        _S.RECALLING: (_C.RECALLING,),
        _S.RECALLED: (_C.RECALLING, _RESULT),
    },
    _C.RECALLING: {
        **_TO_PREEMPTING,
        _S.REJECTED: (_RESULT,),
        _S.RECALLING: (),
        _S.RECALLED: (_RESULT,),
    },
    _C.PREEMPTING: _FROM_PREEMPTING,
    _C.DONE: dict.fromkeys(_OVER, ()),
}


def path(state: int, status: int) -> tuple[int, ...] | None:
    """Return the states that a status of the server leads through; None if it cannot follow."""
    return _PATHS[state].get(status)
