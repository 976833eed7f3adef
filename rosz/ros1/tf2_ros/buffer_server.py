"""tf2_ros.buffer_server: answering lookups of other nodes."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from rosz.errors import RoszError
from rosz.msgs.tf2_msgs.msg import TF2Error
from rosz.ros1.actionlib import ActionServer, ServerGoalHandle
from rosz.ros1.tf2_py import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from rosz.ros1.tf2_ros.buffer import Buffer
from rosz.worker import Worker

__all__ = ("BufferServer",)

_THREADS = 16
"""Lookups that wait at once."""

_ERRORS: dict[type[RoszError], int] = {
    LookupException: TF2Error.LOOKUP_ERROR,
    ConnectivityException: TF2Error.CONNECTIVITY_ERROR,
    ExtrapolationException: TF2Error.EXTRAPOLATION_ERROR,
    InvalidArgumentException: TF2Error.INVALID_ARGUMENT_ERROR,
}


class BufferServer:
    """An action server that looks up transforms for every `BufferClient`.

    Args:
        buffer: Buffer to look them up in.
        ns: Name of the action.
        auto_start: Whether the server starts at once, and not with `start`.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
    """

    def __init__(self, buffer: Buffer, ns: str, auto_start: bool = True) -> None:
        messages = import_module("tf2_msgs.msg")
        self._buffer = buffer
        self._result: type[Any] = messages.LookupTransformResult
        self._worker: Worker[ServerGoalHandle] = Worker(
            f"rosz-buffer-server-{ns}", self._answer, threads=_THREADS
        )
        self._server = ActionServer(
            ns, messages.LookupTransformAction, self._accept, self._cancel, auto_start
        )

    def start(self) -> None:
        """Begin to answer."""
        self._server.start()

    def _accept(self, handle: ServerGoalHandle) -> None:
        handle.set_accepted()
        self._worker.submit(handle)

    def _cancel(self, handle: ServerGoalHandle) -> None:
        handle.set_canceled()

    def _answer(self, handle: ServerGoalHandle) -> None:
        result = self._result()
        try:
            result.transform = self._look_up(handle.get_goal())
        except TransformException as error:
            number = _ERRORS.get(type(error), TF2Error.TRANSFORM_ERROR)
            result.error = TF2Error(number, str(error))
        with self._server.lock:
            if not handle.ended_at:  # else it was cancelled meanwhile
                handle.set_succeeded(result)

    def _look_up(self, goal: Any) -> Any:
        target, source, timeout = goal.target_frame, goal.source_frame, goal.timeout
        if not goal.advanced:
            return self._buffer.lookup_transform(target, source, goal.source_time, timeout)
        return self._buffer.lookup_transform_full(
            target, goal.target_time, source, goal.source_time, goal.fixed_frame, timeout
        )
