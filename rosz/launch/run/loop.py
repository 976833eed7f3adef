"""The event loop of a launch, and the signals that end a launch.

One thread waits for children, pipes, timers and requests, without polling. Other threads and signal
handlers pass work to it with `Loop.post`; everything else belongs to the thread of the loop.
"""

from __future__ import annotations

import heapq
import itertools
import os
import selectors
import signal
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

Action = Callable[[], None]

_MAX_WAIT = 3600.0
"""Limit of one wait in seconds: the system counts milliseconds in 32 bits."""

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


class LoopTimer:
    """A function that will be called once, unless cancelled."""

    __slots__ = ("action",)

    def __init__(self, action: Action) -> None:
        self.action: Action | None = action

    def cancel(self) -> None:
        """Cancel the call; a call already made is not an error."""
        self.action = None


class Loop:
    """Waits for events and calls functions, on the thread that runs it."""

    def __init__(self) -> None:
        self._selector = selectors.DefaultSelector()
        self._timers: list[tuple[float, int, LoopTimer]] = []
        self._order = itertools.count()
        self._posted: deque[Action] = deque()
        self._children: set[int] = set()
        self._waker, self._woken = socket.socketpair()
        self._waker.setblocking(False)
        self._woken.setblocking(False)
        self._selector.register(self._woken, selectors.EVENT_READ, self._wake)
        self._stopped = False

    def now(self) -> float:
        """Return the time that timers use, in seconds."""
        return time.monotonic()

    def later(self, seconds: float, action: Action) -> LoopTimer:
        """Call a function after a delay in seconds."""
        timer = LoopTimer(action)
        heapq.heappush(self._timers, (self.now() + seconds, next(self._order), timer))
        return timer

    def post(self, action: Action) -> None:
        """Call a function soon; safe from any thread or signal handler, also after `close`."""
        self._posted.append(action)
        with suppress(OSError):  # a full socket wakes the loop anyway; a closed loop has ended
            self._waker.send(b"\0")

    def watch(self, fd: int, action: Action) -> None:
        """Call a function whenever a descriptor can be read."""
        self._selector.register(fd, selectors.EVENT_READ, action)

    def unwatch(self, fd: int) -> None:
        """End a `watch`; a second call has no effect."""
        if fd in self._selector.get_map():
            self._selector.unregister(fd)

    def watch_exit(self, pid: int, action: Action) -> None:
        """Call a function once when a child has ended; the caller reaps the child."""
        try:
            fd = os.pidfd_open(pid)
        except (AttributeError, OSError):  # an older kernel: a thread waits instead
            threading.Thread(
                target=self._await_exit, args=(pid, action), name=f"wait-{pid}", daemon=True
            ).start()
            return

        def ended() -> None:
            self.unwatch(fd)
            self._children.discard(fd)
            os.close(fd)
            action()

        self._children.add(fd)
        self.watch(fd, ended)

    def _await_exit(self, pid: int, action: Action) -> None:
        with suppress(ChildProcessError):  # already reaped, so it has ended
            os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
        self.post(action)

    def stop(self) -> None:
        """Make `run` return after the current round, or at once when it is called next."""
        self._stopped = True

    def run(self) -> None:
        """Wait for events and call functions until `stop`."""
        while not self._stopped:
            self.step()
        self._stopped = False

    def step(self, timeout: float | None = None) -> None:
        """Run one round: wait for an event, at most ``timeout`` seconds, and call functions."""
        if self._timers:
            left = min(max(0.0, self._timers[0][0] - self.now()), _MAX_WAIT)
            timeout = left if timeout is None else min(left, timeout)
        if self._posted:
            timeout = 0.0
        for key, _ in self._selector.select(timeout):
            # An earlier function of this round may have ended the watch.
            if self._selector.get_map().get(key.fd) is key:
                key.data()
        self._run_timers()
        for _ in range(len(self._posted)):
            self._posted.popleft()()

    def _run_timers(self) -> None:
        now = self.now()
        while self._timers and self._timers[0][0] <= now:
            timer = heapq.heappop(self._timers)[2]
            action, timer.action = timer.action, None
            if action is not None:
                action()

    def _wake(self) -> None:
        with suppress(BlockingIOError):
            while self._woken.recv(4096):
                pass

    def close(self) -> None:
        """Release the descriptors of the loop; a second call has no effect."""
        self._selector.close()
        for fd in self._children:
            os.close(fd)
        self._children.clear()
        self._waker.close()
        self._woken.close()


@contextmanager
def stopped_by_signals(
    loop: Loop,
    shutdown: Callable[[], None],
    kill: Callable[[], None],
    dump_stacks: Callable[[str], None],
) -> Iterator[None]:
    r"""Let the first signal shut a launch down, and the second one kill its processes.

    SIGQUIT (Ctrl-\) kills them at once. A SIGHUP that is ignored, as under ``nohup``, stays
    ignored. Outside the main thread this installs nothing.

    Args:
        loop: Loop that calls the first two functions.
        shutdown: Called at the first signal.
        kill: Called at each further signal, and at SIGQUIT.
        dump_stacks: Called in the signal handler before ``kill``, with the name of the signal.
    """
    seen = threading.Event()

    def handle(number: int, _frame: object) -> None:
        again = " again" if seen.is_set() else ""
        seen.set()
        if not again and number != signal.SIGQUIT:
            loop.post(shutdown)
            return
        dump_stacks(f"{signal.Signals(number).name}{again}")
        loop.post(kill)

    with _handled_by(handle):
        yield


@contextmanager
def interrupted_by_signals() -> Iterator[None]:
    """Let these signals raise `KeyboardInterrupt`, so that started processes are ended.

    Inside `stopped_by_signals`, the handlers of that one count.
    """

    def handle(_number: int, _frame: object) -> None:
        raise KeyboardInterrupt

    with _handled_by(handle):
        yield


@contextmanager
def _handled_by(handle: Callable[[int, Any], None]) -> Iterator[None]:
    is_main = threading.current_thread() is threading.main_thread()
    with ExitStack() as stack:
        for number in _SIGNALS if is_main else ():
            if number is not signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
                stack.callback(signal.signal, number, signal.signal(number, handle))
        yield
