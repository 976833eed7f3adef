"""Which threads are inside Zenoh right now."""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path

__all__ = ("wait_for_calls",)

_HERE = str(Path(__file__).parent)
_POLL = 0.001


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
