"""Ctrl-C while a module is imported, or a session opens: it waits until that is complete.

Python turns Ctrl-C into an exception between two bytecodes. Raised while msgspec compiles a
decoder, that crashes the process; raised while Zenoh opens a session, it leaves one that nobody
closes, which aborts the process at its end.

This module imports only what is loaded anyway, as Ctrl-C could interrupt the import of more: the
module signal is a layer over ``_signal``.
"""

from __future__ import annotations

import _signal as signal  # type: ignore[import-not-found]  # it has no stubs
import os
import sys
import time

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType, TracebackType
    from typing import Any

_SAME_SIGNAL = 0.1
"""Seconds in which a second signal counts as the first: timeout(1) signals the group as well."""


class InterruptDeferral:
    """A context that Ctrl-C does not interrupt; it takes effect at the end.

    A second Ctrl-C ends the process at once. Nothing is deferred outside the main thread, or if
    Ctrl-C does something else than to raise `KeyboardInterrupt`: then the program, or a context
    around this one, handles it.

    Args:
        undo: Function to call if Ctrl-C then raises an exception. That has no traceback if nobody
            catches it, because it would show places of rosz only.

    Attributes:
        replaced: The handler of Ctrl-C that the context replaces.
    """

    def __init__(self, undo: Callable[[], object] | None = None) -> None:
        self.replaced: Any = None
        self._undo = undo
        self._interrupted_at = 0.0

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        """Take note of Ctrl-C."""
        if not self._interrupted_at:
            self._interrupted_at = time.monotonic()
        elif time.monotonic() - self._interrupted_at > _SAME_SIGNAL:
            os._exit(128 + number)

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C has been deferred."""
        return bool(self._interrupted_at)

    def __enter__(self) -> None:
        self.replaced = signal.getsignal(signal.SIGINT)
        if self.replaced in (signal.default_int_handler, signal.SIG_IGN):
            try:
                signal.signal(signal.SIGINT, self)
            except ValueError:  # not the main thread, or not of the main interpreter
                return

    def __exit__(self, failed: type[BaseException] | None, *_: object) -> None:
        if signal.getsignal(signal.SIGINT) is self:  # a node may have set another handler
            signal.signal(signal.SIGINT, self.replaced)
        if not self._interrupted_at:
            return
        try:
            signal.raise_signal(signal.SIGINT)
        except BaseException as error:
            if not is_interactive():
                _hide_traceback(error)
            if self._undo is not None and failed is None:
                self._undo()
            raise


def raise_deferred() -> None:
    """Raise `KeyboardInterrupt` if Ctrl-C was deferred, where nothing is half done."""
    handler = signal.getsignal(signal.SIGINT)
    if isinstance(handler, InterruptDeferral) and handler.interrupted:
        raise KeyboardInterrupt


def is_interactive() -> bool:
    """Return whether a person types Python into this process, also when the script has ended."""
    return bool(sys.flags.interactive or sys.flags.inspect or hasattr(sys, "ps1"))


def _hide_traceback(hidden: BaseException) -> None:
    show = sys.excepthook

    def hook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if error is not hidden:
            show(kind, error, trace)

    sys.excepthook = hook
