"""Ctrl-C and SIGTERM: the first shuts contexts down, the second ends the process at once.

A program that asks whether it is shut down, or waits in a function of rosz, ends by itself. One
that never does, such as a loop around ``time.sleep``, is interrupted by an exception, but not one
of rospy.

Python runs a signal handler in the main thread between two bytecodes. A signal that comes right
before that thread begins to wait is not handled until the wait ends. So a thread is notified too,
by a pipe that the interpreter writes to when the signal comes. It shuts the contexts down, and
sends the main thread the signal once more if the handler does not run soon. If the pipe belongs to
other code, such as an event loop, the handler shuts the contexts down.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import socket
import threading
import time
from collections.abc import Callable
from types import FrameType

from rosz.interrupts import InterruptDeferral, is_interactive
from rosz.lifecycle import Lifecycle
from rosz.node.context import Context
from rosz.worker import start_thread

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_NO_FD = -1
_SOON = 0.05
_SAME_SIGNAL = 0.1
"""Seconds in which a second signal counts as the first: timeout(1) signals the group as well."""
_REMINDERS = 20


def install(context: Context) -> None:
    """Make signals shut a context down, unless the program handles them itself.

    Nothing happens outside the main thread, or for a signal that has another handler already. A
    signal that is ignored is taken too: shells start background jobs of a script like that, and
    ``kill -INT`` must end them nevertheless, as it ends nodes of rospy. A signal that finds all
    contexts shut down has the effect that it has without rosz.

    Where a person types Python, Ctrl-C interrupts the typed statement, and nodes stay open.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    handlers = [signal.getsignal(number) for number in _SIGNALS]
    handlers = [h.replaced if isinstance(h, InterruptDeferral) else h for h in handlers]
    for present in handlers:
        if isinstance(present, _Handler):
            present.add(context)
            return
    defaults = (signal.default_int_handler, signal.SIG_DFL, signal.SIG_IGN)
    taken = [n for n, present in zip(_SIGNALS, handlers, strict=True) if present in defaults]
    if is_interactive() and signal.SIGINT in taken:
        taken.remove(signal.SIGINT)
    if taken:
        handler = _Handler(taken)
        handler.add(context)
        for number in taken:
            signal.signal(number, handler)


def of_program(number: signal.Signals) -> Callable[[int, FrameType | None], object] | None:
    """Return the handler that the program itself has set for a signal, if any."""
    present = signal.getsignal(number)
    if not callable(present) or isinstance(present, _Handler):
        return None
    return None if present is signal.default_int_handler else present


class _Handler:
    """The handler of the signals of a process, and the contexts that they shut down."""

    def __init__(self, numbers: list[signal.Signals]) -> None:
        self._numbers = numbers
        self._contexts: list[Context] = []
        self._asked = False
        self._asked_at = 0.0
        self._ran = threading.Event()
        self._echoes = 0
        self._lifecycle = Lifecycle("the signal handler", on_fork=self._forked)
        self._reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)
        previous = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)
        if previous != _NO_FD:
            signal.set_wakeup_fd(previous)  # an event loop of the program has it
        threading.Thread(target=self._watch, name="rosz-signal-watch", daemon=True).start()

    def add(self, context: Context) -> None:
        """Add a context that the signals shut down."""
        self._contexts = [*(c for c in self._contexts if not c.is_shutdown), context]
        self._asked = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal; in the main thread, between two bytecodes."""
        self._ran.set()
        contexts = self._contexts
        if not self._asked and all(context.is_shutdown for context in contexts):
            self.restore(number)
            signal.raise_signal(number)
            return
        for context in contexts:
            # The main thread may end before the thread that shuts down.
            context.reason = context.reason or signal.Signals(number).name
        if not self._is_watching():
            self._react(number)
        for context in contexts:
            context.pause_main_thread(frame)
        if not any(context.cooperative for context in contexts):
            if number == signal.SIGINT:
                raise KeyboardInterrupt
            raise SystemExit(128 + number)

    def restore(self, number: int) -> None:
        """Restore the effect that a signal has without rosz."""
        if self._is_watching():
            signal.set_wakeup_fd(_NO_FD)
        default = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
        signal.signal(number, default)

    def _forked(self) -> None:
        """Give the signals back in a forked child, whose pipe is still that of its parent."""
        for number in self._numbers:
            if self._handles(number):
                self.restore(number)

    def _is_watching(self) -> bool:
        own = self._writer.fileno()
        present = signal.set_wakeup_fd(own, warn_on_full_buffer=False)
        if present != own:
            signal.set_wakeup_fd(present)
        return present == own

    def _watch(self) -> None:
        while data := self._reader.recv(64):
            for number in data:
                if number not in self._numbers or not self._handles(number):
                    continue  # the program handles it, perhaps since a moment ago
                if self._echoes:
                    self._echoes -= 1
                    continue
                self._react(number)
                self._remind(number)

    def _handles(self, number: int) -> bool:
        return signal.getsignal(number) is self

    def _remind(self, number: int) -> None:
        """Send the main thread the signal until its handler runs."""
        main = threading.main_thread().ident
        for _ in range(_REMINDERS):
            if self._ran.wait(_SOON) or main is None:
                break
            self._echoes += 1
            signal.pthread_kill(main, number)
        self._ran.clear()

    def _react(self, number: int) -> None:
        if self._asked:
            ending = not all(context.closed for context in self._contexts)
            if ending and time.monotonic() - self._asked_at < _SAME_SIGNAL:
                return
            # End the process at once, and show where every thread is.
            faulthandler.dump_traceback()
            os._exit(128 + number)
        live = [context for context in self._contexts if not context.is_shutdown]
        self._asked, self._asked_at = bool(live), time.monotonic()
        reason = signal.Signals(number).name
        for context in live:
            # On another thread: this one may hold a lock that is needed, and must stay ready.
            name = "rosz-signal"
            start_thread(
                threading.Thread(target=context.shutdown, args=(reason,), name=name, daemon=True)
            )
