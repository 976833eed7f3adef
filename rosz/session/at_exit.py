"""Ending the program while threads use Zenoh.

The Python runtime aborts a program that ends while one of its threads is inside Zenoh. By the time
of the end all sessions are closed, so such a thread is about to leave, and the program waits for
it. To free an object of Zenoh is a call into Zenoh as well. So code in this package deletes the
last name of each object in a function that is still running.

From when `rosz.worker.ENDING` is set nobody may start to wait inside Zenoh. The function that calls
Zenoh has to check it itself. Then either `wait_for_calls` sees that function on a stack, or the
function sees that it is set.
"""

from __future__ import annotations

import atexit
import logging
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from traceback import walk_stack
from types import FrameType
from typing import Any

from rosz.errors import ClosedError
from rosz.session import probe
from rosz.worker import ENDING

OPEN: set[object] = set()
"""Queues to which threads of Zenoh add items; the last of them removes the queue."""

_leaked: list[object] = []
_lost = threading.Lock()
_loss_handlers: list[Callable[[str], object]] = []
_PACKAGE = str(Path(__file__).parent)
_POLL_SECONDS = 0.001
_TIMEOUT = 10.0
"""Seconds; a thread of a busy machine may need more than one to leave."""

_log = logging.getLogger("rosz.session")


def leak_at_exit(thing: object) -> None:
    """Keep an object of Zenoh alive for good, so that no thread frees it during the end."""
    _leaked.append(thing)


def wait_for_calls(timeout: float) -> bool:
    """Set `ENDING`, and wait until nothing is `OPEN`, and no other thread inside this package.

    A thread with a function of it anywhere on its stack may be inside Zenoh, or return to it. The
    threads of `probe` are not waited for: they use plain sockets, and may block for minutes.

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


def _is_in_package(frame: FrameType) -> bool:
    files = [each.f_code.co_filename for each, _ in walk_stack(frame)]
    ours = [file for file in files if file.startswith(_PACKAGE)]
    return bool(ours) and ours[-1] != probe.__file__


def on_loss(handle: Callable[[str], object]) -> None:
    """Let a function end this program, by a reason, when its sessions are lost."""
    _loss_handlers.append(handle)


def lose_sessions(why: str) -> None:
    """End the program with 1, or as `on_loss` says, since no session of it works any more.

    Closing a lost session may never return. Only the first call has an effect.
    """
    if not _lost.acquire(blocking=False):
        return
    _log.critical("the network of this program is lost, and it ends: %s", why)
    for handle in _loss_handlers:
        handle(why)
    if not _loss_handlers:
        os._exit(1)


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
