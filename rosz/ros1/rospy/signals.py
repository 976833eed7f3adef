"""A program's own handlers of signals, set before ``init_node``: first rospy acts, then they do."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from functools import partial
from types import FrameType

from rosz.node.signals import of_program
from rosz.ros1.rospy.core import signal_shutdown
from rosz.ros1.rospy.state import state

__all__ = ("chain",)

_HOOKS_TAKE = 2.0
"""Seconds in which hooks have their turn before the program's handler does."""


def chain() -> None:
    """Have the node end before a handler of the program runs, as in rospy.

    Nothing happens outside the main thread, where Python lets nobody set a handler.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    for number in (signal.SIGINT, signal.SIGTERM):
        own = of_program(number)
        if own is not None:
            signal.signal(number, partial(_end, own))


def _end(
    own: Callable[[int, FrameType | None], object], number: int, frame: FrameType | None
) -> None:
    # On another thread: this one may hold a lock that the end needs.
    ender = threading.Thread(target=signal_shutdown, args=(f"signal-{number}",), daemon=True)
    ender.start()
    state.ended.wait(_HOOKS_TAKE)
    own(number, frame)
