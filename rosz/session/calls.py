"""Leaving no thread inside Zenoh behind at the end of the program.

The runtime aborts a program that ends while a thread of Python is inside Zenoh. All sessions are
closed by then, so whoever is still inside is on the way out, and is waited for. To free a thing of
Zenoh's is a call, too: so the last name of each is deleted in a function that is still under way.
"""

from __future__ import annotations

import atexit
import sys
import threading
import time
from pathlib import Path
from types import FrameType

__all__ = ("ENDING", "keep", "wait_for_calls")

ENDING = threading.Event()
"""Set when the interpreter is about to end: whoever would wait inside Zenoh does not set out.

It has to be asked in the very function that calls Zenoh, so that either that function is seen to be
under way, or it sees this.
"""

_kept: list[object] = []
_HERE = str(Path(__file__).parent)
_POLL = 0.001
_OUT_BY = 1.0


def keep(thing: object) -> None:
    """Keep a thing of Zenoh's from being freed by the thread that has it, at the end."""
    _kept.append(thing)


def wait_for_calls(timeout: float) -> bool:
    """Wait until no other thread is inside a function of the session, and let none wait there.

    A thread that is inside such a function, however deep, may be inside Zenoh, or come back to it.

    Args:
        timeout: Seconds.

    Returns:
        Whether that came to be; false when the time was over.
    """
    ENDING.set()
    deadline = time.monotonic() + timeout
    own = threading.get_ident()
    while any(
        _is_here(frame)
        for thread, frame in sys._current_frames().items()  # noqa: SLF001  # documented, if odd
        if thread != own
    ):
        if time.monotonic() > deadline:
            return False
        time.sleep(_POLL)
    return True


def _is_here(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith(_HERE):
            return True
        frame = frame.f_back
    return False


# Registered before anything that uses a session, and so run after all of that has been closed.
atexit.register(wait_for_calls, _OUT_BY)
