"""Ctrl-C and SIGTERM: the first asks politely, the second leaves.

A program that asks whether it is shut down, or waits through rosz, is told in that way and ends by
itself. One that never does, such as a loop around ``time.sleep``, gets ``KeyboardInterrupt``.

Python runs a signal's handler in the main thread between two steps, and one that comes right before
that thread begins to wait for a lock is not seen until the wait ends. So a thread of its own is
told as well, through a pipe that the interpreter writes to from the signal itself.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import socket
import threading
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosz.node.context import Context

__all__ = ("install",)

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_NO_FD = -1


def install(context: Context) -> None:
    """Have signals shut a context down, where the program has not taken them itself.

    Nothing happens outside the main thread, or for a signal that has another handler already.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    defaults = (signal.default_int_handler, signal.SIG_DFL)
    taken = [number for number in _SIGNALS if signal.getsignal(number) in defaults]
    if not taken:
        return
    handler = _Handler(context)
    for number in taken:
        signal.signal(number, handler)
    _Watcher(context, taken).start()


class _Handler:
    """Runs in the main thread, between two of its steps."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._seen = False

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        if self._seen:
            _leave(number)
        self._seen = True
        _shut_down(self._context, number)
        if not self._context.cooperative:
            raise KeyboardInterrupt


class _Watcher(threading.Thread):
    """Hears of signals while the main thread waits for a lock."""

    def __init__(self, context: Context, numbers: list[signal.Signals]) -> None:
        super().__init__(name="rosz-signal-watch", daemon=True)
        self._context = context
        self._numbers = numbers
        self._reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)
        previous = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)
        if previous != _NO_FD:
            signal.set_wakeup_fd(previous)  # an event loop of the program has it; leave it there

    def run(self) -> None:
        seen = False
        while data := self._reader.recv(64):
            for number in data:
                if number not in self._numbers:
                    continue
                if seen:
                    _leave(number)
                seen = True
                _shut_down(self._context, number)


def _shut_down(context: Context, number: int) -> None:
    """Shut down on a thread: this one may hold a lock that is needed, or has to hear of more."""
    reason = signal.Signals(number).name
    threading.Thread(
        target=context.shutdown, args=(reason,), name="rosz-signal", daemon=True
    ).start()


def _leave(number: int) -> None:
    """End the process at once, telling where every thread stood."""
    faulthandler.dump_traceback()
    os._exit(128 + number)
