"""Ctrl-C and SIGTERM: the first asks politely, the second leaves.

A program that asks whether it is shut down, or waits through rosz, is told in that way and ends by
itself. One that never does, such as a loop around ``time.sleep``, gets ``KeyboardInterrupt``.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import threading
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosz.node.context import Context

__all__ = ("install",)

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def install(context: Context) -> None:
    """Have signals shut a context down, where the program has not taken them itself.

    Nothing happens outside the main thread, or for a signal that has another handler already.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    defaults = (signal.default_int_handler, signal.SIG_DFL)
    taken = [number for number in _SIGNALS if signal.getsignal(number) in defaults]
    seen = threading.Event()

    def handle(number: int, _frame: FrameType | None) -> None:
        name = signal.Signals(number).name
        if seen.is_set():
            faulthandler.dump_traceback()
            os._exit(128 + number)
        seen.set()
        # A handler runs between two steps of the main thread, which may hold a lock of ours.
        threading.Thread(
            target=context.shutdown, args=(name,), name="rosz-signal", daemon=True
        ).start()
        if not context.cooperative:
            raise KeyboardInterrupt

    for number in taken:
        signal.signal(number, handle)
