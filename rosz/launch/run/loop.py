"""One thread that waits for everything a launch waits for: children, pipes, timers, requests.

Nothing here polls. Other threads and signal handlers hand work over with `Loop.post`; all else
belongs to the thread that runs the loop.
"""

from __future__ import annotations

import heapq
import itertools
import os
import selectors
import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress

__all__ = ("Loop", "Timer")

Action = Callable[[], None]

_LONGEST_WAIT = 3600.0
"""Seconds of one wait: the system counts milliseconds in 32 bits, which timers may exceed."""


class Timer:
    """A call that will be made once, unless cancelled.

    Args:
        action: What to call.
    """

    __slots__ = ("action",)

    def __init__(self, action: Action) -> None:
        self.action: Action | None = action

    def cancel(self) -> None:
        """Take it back; when it is over that is no error."""
        self.action = None


class Loop:
    """Waits and calls back, on the thread that runs it."""

    def __init__(self) -> None:
        self._selector = selectors.DefaultSelector()
        self._timers: list[tuple[float, int, Timer]] = []
        self._order = itertools.count()
        self._posted: deque[Action] = deque()
        self._children: set[int] = set()
        self._waker, self._woken = socket.socketpair()
        self._waker.setblocking(False)
        self._woken.setblocking(False)
        self._selector.register(self._woken, selectors.EVENT_READ, self._wake)
        self._stopped = False

    def now(self) -> float:
        """Return the time that timers go by, in seconds."""
        return time.monotonic()

    def later(self, seconds: float, action: Action) -> Timer:
        """Have something called after so many seconds."""
        timer = Timer(action)
        heapq.heappush(self._timers, (self.now() + seconds, next(self._order), timer))
        return timer

    def post(self, action: Action) -> None:
        """Have something called soon; from any thread or signal handler, also when closed."""
        self._posted.append(action)
        try:
            self._waker.send(b"\0")
        except OSError:
            return  # full: it wakes anyway; closed: nobody is left to wake

    def watch(self, fd: int, action: Action) -> None:
        """Have something called whenever a descriptor can be read."""
        self._selector.register(fd, selectors.EVENT_READ, action)

    def unwatch(self, fd: int) -> None:
        """End a `watch`; again is no error."""
        if fd in self._selector.get_map():
            self._selector.unregister(fd)

    def watch_exit(self, pid: int, action: Action) -> None:
        """Have something called once when a child has ended; the child is left to be reaped."""
        try:
            fd = os.pidfd_open(pid)
        except (AttributeError, OSError):  # another kernel: a thread waits instead
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
        with suppress(ChildProcessError):  # reaped already: it has ended
            os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
        self.post(action)

    def stop(self) -> None:
        """Make `run` return after the present round, or at once when it is called next."""
        self._stopped = True

    def run(self) -> None:
        """Wait and call back until `stop`."""
        while not self._stopped:
            self.step()
        self._stopped = False

    def step(self, timeout: float | None = None) -> None:
        """Do one round: wait for something, at most so many seconds, and call back."""
        if self._timers:
            left = min(max(0.0, self._timers[0][0] - self.now()), _LONGEST_WAIT)
            timeout = left if timeout is None else min(left, timeout)
        if self._posted:
            timeout = 0.0
        for key, _ in self._selector.select(timeout):
            # An earlier call of this round may have ended the watch.
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
        try:
            while self._woken.recv(4096):
                pass
        except BlockingIOError:
            return

    def close(self) -> None:
        """Release the descriptors of the loop; again is no error."""
        self._selector.close()
        for fd in self._children:
            os.close(fd)
        self._children.clear()
        self._waker.close()
        self._woken.close()
