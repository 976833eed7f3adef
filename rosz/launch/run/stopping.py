r"""What ends a launch from outside: Ctrl-C, SIGTERM, a closed terminal, and Ctrl-\ at once.

None of them leaves a node running. Only SIGKILL does, of which a process does not hear.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rosz.launch.run.console import Console
from rosz.launch.run.loop import Loop

__all__ = ("interrupted_by_signals", "stopped_by_signals")

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


@contextmanager
def stopped_by_signals(
    loop: Loop, console: Console, shutdown: Callable[[], None], kill: Callable[[], None]
) -> Iterator[None]:
    """Have the first signal shut a launch down, and a second one kill what is left.

    SIGQUIT does not ask: it kills what there is, first or not, since who sends it has no patience.
    A SIGHUP that is ignored stays so, as ``nohup`` means it. Outside the main thread nothing is
    installed.

    Args:
        loop: Where the two are called.
        console: Its log gets the stacks of all threads at the second signal.
        shutdown: Called at the first.
        kill: Called at each further one, and at SIGQUIT.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    seen = threading.Event()

    def handle(number: int, _frame: object) -> None:
        again = " again" if seen.is_set() else ""
        seen.set()
        if not again and number != signal.SIGQUIT:
            loop.post(shutdown)
            return
        if console.log is not None:
            console.log.dump_stacks(f"{signal.Signals(number).name}{again}")
        loop.post(kill)

    with _handled_by(handle):
        yield


@contextmanager
def interrupted_by_signals() -> Iterator[None]:
    """Have these signals raise `KeyboardInterrupt`, so that what has been started is ended.

    For as long as `stopped_by_signals` does not say otherwise.
    """

    def handle(_number: int, _frame: object) -> None:
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    with _handled_by(handle):
        yield


@contextmanager
def _handled_by(handle: Callable[[int, Any], None]) -> Iterator[None]:
    before: dict[signal.Signals, Any] = {}
    for number in _SIGNALS:
        if number is not signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
            before[number] = signal.signal(number, handle)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
