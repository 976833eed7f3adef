"""A bounded queue of items, and the threads that handle them.

Everything in rosz that runs on a thread of its own goes through a `Worker`: tasks of the parameter
store, service calls, log records on their way out, text for a slow terminal. A worker either has a
queue of its own, filled by `Worker.submit` and `Worker.offer`, or receives from a queue that
somebody else fills, such as a Zenoh channel. What has something to do only now and then borrows a
thread for it with `lend_thread`.
"""

from __future__ import annotations

import heapq
import itertools
import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Any, Generic, TypeVar

from rosz.errors import ClosedError
from rosz.program import Program, current, within

T = TypeVar("T")

ENDING = threading.Event()
"""Set when the interpreter is about to end. From then on errors on threads are not logged, since
everything that they use is being closed."""

_log = logging.getLogger("rosz.worker")
_CLOSE_TIMEOUT = 2.0
_LENT_SECONDS = 5.0
"""How long a thread that was lent waits for the next task."""


def start_thread(thread: threading.Thread) -> bool:
    """Start a thread, unless the process is ending.

    Python 3.12 starts no thread once the main thread has ended, not even before the functions
    registered with atexit have run (What's New in Python 3.12, Changes in the Python API).

    Args:
        thread: Thread that has not been started yet.

    Returns:
        Whether the thread was started.

    Raises:
        RuntimeError: The system has no more threads.
    """
    try:
        thread.start()
    except RuntimeError:
        if threading.main_thread().is_alive():
            raise
        return False
    return True


def run_task(task: Callable[[], object]) -> None:
    """Call a task; the default handler of a `Worker` whose items are functions."""
    task()


def lend_thread(task: Callable[[], object]) -> bool:
    """Call a function on a thread that nobody uses; any thread, and any signal handler, may do so.

    Tasks that end soon share a few such threads; each task that blocks has one of its own. They are
    daemons. A task belongs to the program of its caller;
    see `rosz.program.current`.

    Args:
        task: The function; an exception that it raises is logged.

    Returns:
        Whether it will be called: false if no thread is free, and none can be started since the
        process ends or has too many.
    """
    if not (_free_threads or _add_lent_thread()):
        return False
    _tasks.put((current(), task))
    if not _free_threads:  # the thread that was free has taken another task
        _add_lent_thread()
    return True


def _add_lent_thread() -> bool:
    thread = threading.Thread(target=_lend, name="rosz-lent", daemon=True)
    _free_threads.append(True)
    with within(None), suppress(RuntimeError):
        if start_thread(thread):
            return True
    _free_threads.pop()
    return False


def _lend() -> None:
    """Call tasks, until none has come within the time for which a thread is kept."""
    free, tasks = _free_threads, _tasks
    while True:
        try:
            program, task = tasks.get(timeout=_LENT_SECONDS)
            free.pop()
        except Empty:
            free.pop()
            try:
                program, task = tasks.get_nowait()  # it counted on this thread
            except Empty:
                return
        if not (free or tasks.empty()):
            _add_lent_thread()
        try:
            with within(program):
                task()
        except Exception:  # noqa: BLE001  # the thread outlives what a task raises
            if not ENDING.is_set():
                _log.exception("a task on a thread that was lent failed")
        del program, task
        free.append(True)


_tasks: SimpleQueue[tuple[Program | None, Callable[[], object]]] = SimpleQueue()
_free_threads: deque[bool] = deque()
"""One item for each thread that waits for a task, or is about to."""


def _forget_lent_threads() -> None:
    global _tasks  # noqa: PLW0603  # a thread of the parent may hold the lock of the old one
    _tasks = SimpleQueue()
    _free_threads.clear()


os.register_at_fork(after_in_child=_forget_lent_threads)


class Serial:
    """Work that lent threads do, one thread at a time, when there is some.

    Args:
        work: Function that does all that there is to do. It is called again if there is more.
        keeps_thread: Whether the same thread does it while there is something to do every few
            seconds, as each connection of ROS 1 has its thread: a callback may use what is bound to
            one, such as objects of sqlite3.
    """

    def __init__(self, work: Callable[[], object], *, keeps_thread: bool = False) -> None:
        self._work = work
        self._seconds = _LENT_SECONDS if keeps_thread else 0.0
        self._program = current()
        self._more = False
        self._calls: SimpleQueue[None] = SimpleQueue()
        self._working = threading.Lock()

    def wake(self) -> None:
        """Start the work on another thread, if it is not running; neither blocks nor raises.

        If no thread can be lent, the work waits for the next call that gets one.
        """
        if self._more:
            return
        self._more = True
        if not self._working.acquire(blocking=False):
            self._calls.put(None)
        elif not lend_thread(self._run):
            self._more = False
            self._working.release()

    def _run(self) -> None:
        more = True
        with within(self._program):
            while more:
                try:
                    self._work_until_idle()
                finally:
                    self._working.release()
                # A call may have come between the end of the wait and the release.
                more = self._more and self._working.acquire(blocking=False)

    def _work_until_idle(self) -> None:
        with suppress(Empty):
            while True:
                self._more = False
                self._work()
                self._calls.get(timeout=self._seconds)


def handle_all(receive: Callable[[], T | None], handle: Callable[[T], object]) -> None:
    """Handle items until ``receive`` returns ``None``."""
    while (item := receive()) is not None:
        handle(item)
        del item


class _Delayed:
    """An item that is due later."""

    def __init__(self, due: float, item: Any) -> None:
        self.due = due
        self.item = item


class Worker(Generic[T]):
    """Threads that handle items in the order of their arrival.

    Threads are daemons. They start when the first item arrives, and stay until the worker is
    closed. With several threads, one of them always waits for the next item, as long as there are
    fewer than ``threads``.

    Args:
        name: Name of the threads, shown in stack dumps.
        handle: Function called with each item on a thread of the worker. By default the items are
            functions, which are called. An exception that it raises is logged.
        receive: Function that blocks until an item arrives, and returns ``None`` at the end, to
            every thread that calls it. When given, the worker has no queue of its own: its threads
            start at once, and `submit`, `offer`, `later` and `flush` must not be called.
        threads: Largest number of threads.
        capacity: Largest total size of the items that wait; `offer` refuses more.
        size: Function that returns the size of an item; by default each counts as 1.
        logger: Logger that reports exceptions of ``handle``.

    Raises:
        RuntimeError: The system has no more threads (with ``receive`` only).
    """

    def __init__(
        self,
        name: str,
        handle: Callable[[T], object] = run_task,  # type: ignore[assignment]
        *,
        receive: Callable[[], T | None] | None = None,
        threads: int = 1,
        capacity: int | None = None,
        size: Callable[[T], int] | None = None,
        logger: logging.Logger = _log,
    ) -> None:
        self.name = name
        self._handle = handle
        self._receive = receive or self._next
        self._limit = threads
        self._capacity = capacity
        self._size = size
        self._log = logger
        # A SimpleQueue is reentrant: a signal handler that logs may submit while submit runs.
        # Beside items it holds the events that `flush` waits for, and None at its end.
        self._queue: SimpleQueue[T | _Delayed | threading.Event | None] = SimpleQueue()
        self._delayed: list[tuple[float, int, T]] = []
        self._numbers = itertools.count()
        self._waiting = 0
        self._lock = threading.RLock()
        self._when_free: list[Callable[[], object]] = []
        self._threads: set[threading.Thread] = set()
        self._idle = 0
        self._program = current()  # its threads may start on a thread of another one
        self.closed: bool = False
        if receive is not None:
            self._add_thread()

    def submit(self, item: T) -> None:
        """Queue an item, whatever waits already; a closed worker drops it."""
        if self.closed:
            return
        if self._size is not None:
            with self._lock:
                self._waiting += self._size(item)
        self._put(item)

    def offer(self, item: T) -> bool:
        """Queue an item unless the queue is full.

        Returns:
            Whether it was queued.
        """
        if self.closed or self.full:
            return False
        self.submit(item)
        return True

    def later(self, seconds: float, item: T) -> None:
        """Queue an item after a delay; `close` drops it if it is not due yet.

        Only a worker with one thread has delayed items.

        Args:
            seconds: Delay in seconds.
            item: Item to handle then.
        """
        if not self.closed:
            self._put(_Delayed(time.monotonic() + seconds, item))

    @property
    def full(self) -> bool:
        """Whether the queue has reached its capacity."""
        return self._capacity is not None and self.waiting >= self._capacity

    @property
    def waiting(self) -> int:
        """Total size of the items that have not been handled."""
        return self._queue.qsize() if self._size is None else self._waiting

    @property
    def is_current(self) -> bool:
        """Whether the caller runs on a thread of this worker."""
        return threading.current_thread() in self._threads

    def when_free(self, callback: Callable[[], object]) -> None:
        """Call a function once when the queue is not full, now or on a thread of the worker."""
        with self._lock:
            if self.full:
                self._when_free.append(callback)
                return
        callback()

    def flush(self, timeout: float) -> bool:
        """Wait until all items queued so far have been handled.

        A call on a thread of the worker returns at once.

        Args:
            timeout: Time limit in seconds.

        Returns:
            Whether they have been.
        """
        if self.is_current or self.closed or not self._threads:
            return not self.waiting
        reached = threading.Event()
        self._queue.put(reached)
        return reached.wait(timeout)

    def close(self, timeout: float = _CLOSE_TIMEOUT) -> None:
        """Handle the queued items, and end; a second call has no effect.

        A worker with ``receive`` ends when that returns ``None``; this only waits for it.

        Args:
            timeout: Longest time to wait for the threads, in seconds.
        """
        with self._lock:
            first, self.closed = not self.closed, True
        if first:
            self._queue.put(None)
        if self.is_current:
            return
        deadline = time.monotonic() + timeout
        for thread in list(self._threads):
            thread.join(max(0.0, deadline - time.monotonic()))

    def _put(self, item: T | _Delayed) -> None:
        self._queue.put(item)
        if not self._threads:
            with self._lock:
                if not self._threads:
                    self._add_thread()

    def _add_thread(self) -> None:
        thread = threading.Thread(target=self._run, name=self.name, daemon=True)
        self._threads.add(thread)
        self._idle += 1
        started = False
        try:
            with within(self._program):
                started = start_thread(thread)
        finally:
            if not started:
                self._threads.discard(thread)
                self._idle -= 1

    def _run(self) -> None:
        single = self._limit == 1
        while (item := self._receive()) is not None:
            if not single:
                self._let_another_wait()
            try:
                self._handle(item)
            except Exception as error:  # noqa: BLE001  # the thread outlives what a handler raises
                if not (ENDING.is_set() or (self.closed and isinstance(error, ClosedError))):
                    self._log.exception("%s: handling an item failed", self.name)
            finally:
                if not single:
                    with self._lock:
                        self._idle += 1
            if self._size is not None:
                self._free(self._size(item))
            elif self._when_free:
                self._free(0)
            del item

    def _let_another_wait(self) -> None:
        """Make sure that a thread waits for the next item while this one handles the last."""
        with self._lock:
            self._idle -= 1
            if self._idle or len(self._threads) >= self._limit:
                return
            with suppress(RuntimeError):  # no more threads: the next item waits for one of these
                self._add_thread()

    def _free(self, size: int) -> None:
        with self._lock:
            self._waiting -= size
            if not self._when_free or self.full:
                return
            callbacks, self._when_free = self._when_free, []
        for callback in callbacks:
            callback()

    def _next(self) -> T | None:
        """Return the next item that is due; ``None`` when the worker is closed."""
        while True:
            if self._delayed and self._delayed[0][0] <= time.monotonic():
                return heapq.heappop(self._delayed)[2]
            wait = max(0.0, self._delayed[0][0] - time.monotonic()) if self._delayed else None
            try:
                entry = self._queue.get(timeout=wait)
            except Empty:
                continue
            if entry is None:
                self._end_flushes()
                self._queue.put(None)  # for the other threads
                return None
            if isinstance(entry, threading.Event):
                entry.set()
            elif isinstance(entry, _Delayed):
                heapq.heappush(self._delayed, (entry.due, next(self._numbers), entry.item))
            else:
                return entry

    def _end_flushes(self) -> None:
        """Wake those who called `flush` while the worker was being closed."""
        with suppress(Empty):
            while True:
                entry = self._queue.get_nowait()
                if isinstance(entry, threading.Event):
                    entry.set()
