"""Ending the program while threads use Zenoh.

The Python runtime aborts a program that ends while one of its threads is inside Zenoh. By the time
of the end all sessions are closed, so such a thread is about to leave, and the program waits for
it. To free an object of Zenoh is a call into Zenoh as well. So code in this package deletes the
last name of each object in a function that is still running.
"""

from __future__ import annotations

import atexit
import sys
import threading
import time
from pathlib import Path
from types import FrameType
from typing import Any

from rosz.errors import ClosedError

__all__ = ("ENDING", "OPEN", "ClosedSession", "leak_at_exit", "wait_for_calls")

ENDING = threading.Event()
"""Set when the interpreter is about to end: from then on nobody may start to wait inside Zenoh.

The function that calls Zenoh has to check it itself. Then either `wait_for_calls` sees that
function on a stack, or the function sees that this is set.
"""

OPEN: set[object] = set()
"""Queues to which threads that Zenoh started add items; a thread removes its queue when it ends."""

_leaked: list[object] = []
_PACKAGE = str(Path(__file__).parent)
_POLL_SECONDS = 0.001
_TIMEOUT = 10.0
"""Seconds; a thread of a busy machine may need more than one to leave."""


def leak_at_exit(thing: object) -> None:
    """Keep an object of Zenoh alive for good, so that no thread frees it during the end."""
    _leaked.append(thing)


def wait_for_calls(timeout: float) -> bool:
    """Set `ENDING`, and wait until nothing is `OPEN`, and no other thread inside this package.

    A thread with a function of it anywhere on its stack may be inside Zenoh, or return to it.

    Args:
        timeout: Time limit in seconds.

    Returns:
        Whether all threads have left; false if the time limit was reached.
    """
    ENDING.set()
    deadline = time.monotonic() + timeout
    own = threading.get_ident()
    while OPEN or any(
        _is_in_package(frame)
        for thread, frame in sys._current_frames().items()  # noqa: SLF001  # a documented function
        if thread != own
    ):
        if time.monotonic() > deadline:
            return False
        time.sleep(_POLL_SECONDS)
    return True


def _is_in_package(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith(_PACKAGE):
            return True
        frame = frame.f_back
    return False


class ClosedSession:
    """The stand-in for Zenoh's session once that is closed: any use of it raises an error.

    Args:
        why: The reason to give in the errors.
    """

    def __init__(self, why: str) -> None:
        self._why = why

    def __getattr__(self, name: str) -> Any:
        raise ClosedError(f"no {name.replace('_', ' ')} any more: {self._why}")


# Registered before everything that uses a session, and so called after all of that is closed.
atexit.register(wait_for_calls, _TIMEOUT)
