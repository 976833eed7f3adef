"""Leaving no thread inside Zenoh behind at the end of the program.

The runtime aborts a program that ends while a thread of Python is inside Zenoh. All sessions are
closed by then, so whoever is still inside is on the way out, and is waited for.
"""

from __future__ import annotations

import atexit
import sys
import threading
import time
from pathlib import Path

__all__ = ("wait_for_calls",)

_HERE = str(Path(__file__).parent)
_POLL = 0.001
_OUT_BY = 1.0


def wait_for_calls(timeout: float) -> bool:
    """Wait until no other thread is inside a call of the session.

    A thread inside Zenoh shows as one whose innermost Python frame is of this package.

    Args:
        timeout: Seconds.

    Returns:
        Whether that came to be; false when the time was over.
    """
    deadline = time.monotonic() + timeout
    own = threading.get_ident()
    while any(
        frame.f_code.co_filename.startswith(_HERE)
        for thread, frame in sys._current_frames().items()  # noqa: SLF001  # documented, if odd
        if thread != own
    ):
        if time.monotonic() > deadline:
            return False
        time.sleep(_POLL)
    return True


# Registered before anything that uses a session, and so run after all of that has been closed.
atexit.register(wait_for_calls, _OUT_BY)
