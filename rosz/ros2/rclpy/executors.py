"""rclpy.executors, rclpy.task and rclpy.callback_groups: how and when callbacks run.

A message from the network waits in its entity (subscription, service, …), which wakes the executor.
The executor then collects what is ready from the entities of its nodes, and runs each callback once
before it collects again, so that no entity starves.
"""

from __future__ import annotations

import inspect
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Coroutine, Generator, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple, Protocol, Self

from rosz.errors import RoszError
from rosz.ros2.rclpy.context import Context, get_default_context
from rosz.session import clamp_timeout

Job = Callable[[], object]
_THREADS = 4


class TimeoutException(RoszError):
    """Nothing was ready in time."""


class ShutdownException(RoszError):
    """The executor was shut down."""

    def __init__(self) -> None:
        super().__init__("the executor was shut down")


class ExternalShutdownException(RoszError):
    """The context was shut down by a signal."""

    def __init__(self) -> None:
        super().__init__("the context was shut down by a signal")


class CallbackGroup:
    """A set of callbacks that says which of them may run at the same time.

    Only executors with several threads look at it.
    """

    def enter(self) -> bool:
        """Begin a callback of the group, and return whether it may run now."""
        return True

    def leave(self) -> None:
        """End a callback of the group."""


class ReentrantCallbackGroup(CallbackGroup):
    """Callbacks that may all run at the same time."""


class MutuallyExclusiveCallbackGroup(CallbackGroup):
    """Callbacks that run one at a time."""

    def __init__(self) -> None:
        self._running = threading.Lock()

    def enter(self) -> bool:
        """Begin a callback unless another one runs."""
        return self._running.acquire(blocking=False)

    def leave(self) -> None:
        """Allow the next callback."""
        self._running.release()


class Future:
    """A result that comes later.

    Args:
        executor: Executor that runs the callbacks of the future; when not given, the thread that
            sets the result does.
    """

    def __init__(self, *, executor: Any = None) -> None:
        self._lock = threading.Lock()
        self._executor = executor
        self._done = False
        self._cancelled = False
        self._result: Any = None
        self._exception: BaseException | None = None
        self._callbacks: list[Callable[[Any], object]] = []

    def done(self) -> bool:
        """Return whether there is a result, an exception or a cancellation."""
        return self._done or self._cancelled

    def cancelled(self) -> bool:
        """Return whether the future was cancelled."""
        return self._cancelled

    def cancel(self) -> None:
        """Cancel the future unless it is done."""
        with self._lock:
            if self._done:
                return
            self._cancelled = True
        self._run_callbacks()

    def result(self) -> Any:
        """Return the result; None while there is none.

        Raises:
            Exception: The exception that was set instead of a result.
        """
        if self._exception is not None:
            raise self._exception
        return self._result

    def exception(self) -> BaseException | None:
        """Return the exception that was set; None if there is none."""
        return self._exception

    def set_result(self, result: Any) -> None:
        """Set the result, and run the callbacks."""
        self._set(result, None)

    def set_exception(self, exception: BaseException) -> None:
        """Set an exception instead of a result, and run the callbacks."""
        self._set(None, exception)

    def _set(self, result: Any, exception: BaseException | None) -> None:
        with self._lock:
            self._result, self._exception = result, exception
            self._done = True
        self._run_callbacks()

    def add_done_callback(self, callback: Callable[[Any], object]) -> None:
        """Call a function with the future when it is done, or soon if it is done already."""
        with self._lock:
            if not self.done():
                self._callbacks.append(callback)
                return
        self._call(callback)

    def _run_callbacks(self) -> None:
        with self._lock:
            callbacks, self._callbacks = self._callbacks, []
        for callback in callbacks:
            self._call(callback)

    def _call(self, callback: Callable[[Any], object]) -> None:
        if self._executor is None:
            callback(self)
        else:
            self._executor.call_soon(lambda: callback(self))

    def __await__(self) -> Generator[Any, None, Any]:
        while not self.done():
            loop = None if getattr(_stepping, "task", None) else _asyncio_loop()
            if loop is None:
                yield self  # to `Task.step`
            else:
                waiter = loop.create_future()
                self.add_done_callback(partial(_wake_waiter, loop, waiter))
                yield from waiter
        return self.result()


_stepping = threading.local()
"""The task that each thread steps; a coroutine without one is awaited by asyncio."""


def _asyncio_loop() -> Any:
    """Return the loop of asyncio that runs on this thread; None if there is none."""
    asyncio = sys.modules.get("asyncio")
    try:
        return None if asyncio is None else asyncio.get_running_loop()
    except RuntimeError:
        return None


def _wake_waiter(loop: Any, waiter: Any, _: Future) -> None:
    def wake() -> None:
        if not waiter.done():
            waiter.set_result(None)

    with suppress(RuntimeError):  # the loop is closed: nobody waits
        loop.call_soon_threadsafe(wake)


class Task(Future):
    """A function that an executor runs, and that may await futures.

    Args:
        handler: The function, or a coroutine function.
        args: Its arguments.
        kwargs: Its keyword arguments.
        executor: Executor that runs the task.
    """

    def __init__(
        self,
        handler: Callable[..., Any],
        args: tuple[Any, ...] = (),
        kwargs: dict[str, Any] | None = None,
        *,
        executor: Any,
    ) -> None:
        super().__init__(executor=executor)
        self._start: Callable[[], Any] = lambda: handler(*args, **(kwargs or {}))
        self._coroutine: Coroutine[Any, None, Any] | None = None

    def step(self) -> None:
        """Run the task until it waits or ends; an exception of it is raised as well."""
        if self.done():
            return
        try:
            if self._coroutine is None:
                result = self._start()
                if not inspect.iscoroutine(result):
                    self.set_result(result)
                    return
                self._coroutine = result
            _stepping.task = self
            try:
                awaited = self._coroutine.send(None)
            finally:
                _stepping.task = None
        except StopIteration as stop:
            self.set_result(stop.value)
        except BaseException as error:
            self.set_exception(error)
            raise
        else:
            if isinstance(awaited, Future):
                awaited.add_done_callback(lambda _: self._executor.call_soon(self.step))
            else:
                self._executor.call_soon(self.step)


class Entity(Protocol):
    """A subscription, service or timer: something that has callbacks.

    Attributes:
        callback_group: Group of its callbacks.
    """

    callback_group: CallbackGroup

    def take(self) -> Callable[[], Any] | None:
        """Return the next function to call; None if nothing is ready."""


class Ready(NamedTuple):
    """A callback that is ready, its group, which has been entered, and its node."""

    job: Job
    group: CallbackGroup | None
    node: Any


class Executor:
    """Base class of executors, which run the callbacks of nodes.

    Args:
        context: Context whose shutdown ends the executor; the default one when not given.
    """

    def __init__(self, *, context: Context | None = None) -> None:
        self.context: Context = context or get_default_context()
        self._nodes: list[Any] = []
        # One for each wait. An event would stay locked if Ctrl-C interrupted one of its methods.
        self._wakeups: list[SimpleQueue[None]] = []
        self._soon: deque[Job] = deque()
        self._ready: deque[Ready] = deque()
        self._is_shutdown = False
        self.context.on_shutdown(self.wake)

    def add_node(self, node: Any) -> bool:
        """Run the callbacks of a node from now on; return whether the node is new."""
        if node in self._nodes:
            return False
        self._nodes = [*self._nodes, node]
        node.executor = self
        self.wake()
        return True

    def remove_node(self, node: Any) -> None:
        """Stop running the callbacks of a node."""
        self._nodes = [other for other in self._nodes if other is not node]
        if node.executor is self:
            node.executor = None

    def get_nodes(self) -> list[Any]:
        """Return the nodes whose callbacks the executor runs."""
        return list(self._nodes)

    def wake(self) -> None:
        """Make the executor look for ready callbacks; any thread may call this."""
        for wakeup in tuple(self._wakeups):
            if wakeup.empty():
                wakeup.put(None)

    def call_soon(self, job: Job) -> None:
        """Run a function like a callback; any thread may call this."""
        self._soon.append(job)
        self.wake()

    def create_task(self, callback: Callable[..., Any], *args: Any, **kwargs: Any) -> Task:
        """Run a function or a coroutine function like a callback."""
        task = Task(callback, args, kwargs, executor=self)
        self.call_soon(task.step)
        return task

    def spin(self) -> None:
        """Run callbacks until the executor or its context is shut down.

        Raises:
            ExternalShutdownException: A signal shut the context down.
        """
        while self.context.ok() and not self._is_shutdown:
            self.spin_once()
        if self.context.ended_by_signal:
            raise ExternalShutdownException

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait until a callback is ready, and run it.

        Args:
            timeout_sec: Time limit in seconds; none when not given.

        Raises:
            ExternalShutdownException: A signal shut the context down.
        """
        self._once(timeout_sec, lambda: False)

    def spin_until_future_complete(self, future: Future, timeout_sec: float | None = None) -> None:
        """Run callbacks until a future is done.

        Args:
            future: The future.
            timeout_sec: Time limit in seconds; none when not given.
        """
        future.add_done_callback(lambda _: self.wake())
        deadline = _deadline(timeout_sec)
        while self.context.ok() and not self._is_shutdown and not future.done():
            left = None if deadline is None else deadline - time.monotonic()
            if left is not None and left <= 0:
                return
            self._once(left, future.done)

    def spin_once_until_future_complete(
        self, future: Future, timeout_sec: float | None = None
    ) -> None:
        """Run one callback unless a future is done before; see `spin_once`."""
        future.add_done_callback(lambda _: self.wake())
        self._once(timeout_sec, future.done)

    def wait_for_ready_callbacks(self, timeout_sec: float | None = None) -> Ready:
        """Wait until a callback is ready, and return it; executors of programs call this.

        Args:
            timeout_sec: Time limit in seconds; none when not given.

        Returns:
            A function that runs the callback, its group and its node.

        Raises:
            TimeoutException: No callback is ready in time.
            ShutdownException: The executor or the context is shut down.
            ExternalShutdownException: A signal shut the context down.
        """
        ready = self._wait(timeout_sec, lambda: False)
        if ready is not None:
            return ready
        if self._is_shutdown or not self.context.ok():
            raise ShutdownException
        raise TimeoutException(f"no callback is ready after {timeout_sec} s")

    def shutdown(self, timeout_sec: float | None = None) -> bool:  # noqa: ARG002  # rclpy's
        """End all spinning."""
        self._is_shutdown = True
        self.wake()
        return True

    def _once(self, timeout: float | None, finished: Callable[[], bool]) -> None:
        ready = self._wait(timeout, finished)
        if ready is not None:
            self._run(ready.job, ready.group)

    def _wait(self, timeout: float | None, finished: Callable[[], bool]) -> Ready | None:
        deadline = _deadline(timeout)
        wakeup: SimpleQueue[None] = SimpleQueue()
        self._wakeups.append(wakeup)
        try:
            while self.context.ok() and not self._is_shutdown and not finished():
                while not wakeup.empty():
                    wakeup.get()
                ready = self._next()
                if ready is not None:
                    return ready
                left = None if deadline is None else deadline - time.monotonic()
                if left is not None and left <= 0:
                    return None
                with suppress(Empty):
                    wakeup.get(timeout=left)
        finally:
            self._wakeups.remove(wakeup)
        if self.context.ended_by_signal:
            raise ExternalShutdownException
        return None

    def _next(self) -> Ready | None:
        if self._soon:
            return Ready(self._soon.popleft(), None, None)
        if not self._ready:
            self._ready.extend(self._collect())
        return self._ready.popleft() if self._ready else None

    def _collect(self) -> Iterable[Ready]:
        for node in self._nodes:
            for entity in node.rosz_entities():
                group = entity.callback_group
                if not self._enter(group):
                    continue
                call = entity.take()
                if call is None:
                    self._leave(group)
                    continue
                yield Ready(Task(call, executor=self).step, group, node)

    def _enter(self, _group: CallbackGroup) -> bool:
        """Begin a callback of a group; with one thread no two run at the same time anyway."""
        return True

    def _leave(self, group: CallbackGroup) -> None:
        """End a callback of a group."""

    def _run(self, job: Job, group: CallbackGroup | None) -> None:
        try:
            job()
        finally:
            if group is not None:
                self._leave(group)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.shutdown()


class SingleThreadedExecutor(Executor):
    """Run one callback at a time, on the thread that spins."""


class MultiThreadedExecutor(Executor):
    """Run callbacks on several threads, as far as their groups allow.

    Args:
        num_threads: Number of threads; 4 when not given.
        context: Context whose shutdown ends the executor; the default one when not given.
    """

    def __init__(self, num_threads: int | None = None, *, context: Context | None = None) -> None:
        super().__init__(context=context)
        # Not a `Worker`: the end of the program waits for callbacks that run, as with rclpy.
        self._pool = ThreadPoolExecutor(num_threads or _THREADS, thread_name_prefix="rosz-executor")
        self._failed: deque[BaseException] = deque()

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """End all spinning, and wait for the callbacks that are running."""
        super().shutdown(timeout_sec)
        self._pool.shutdown(wait=timeout_sec is None, cancel_futures=True)
        return True

    def _enter(self, group: CallbackGroup) -> bool:
        return group.enter()

    def _leave(self, group: CallbackGroup) -> None:
        group.leave()

    def _run(self, job: Job, group: CallbackGroup | None) -> None:
        def work() -> None:
            try:
                job()
            except BaseException as error:  # noqa: BLE001  # raised on the thread that spins
                self._failed.append(error)
            finally:
                if group is not None:
                    self._leave(group)
                self.wake()

        try:
            self._pool.submit(work)
        except RuntimeError:
            if not self._is_shutdown:  # by another thread, after the callback was found ready
                raise
        self._raise_failure()

    def _next(self) -> Ready | None:
        self._raise_failure()
        return super()._next()

    def _raise_failure(self) -> None:
        if self._failed:
            raise self._failed.popleft()


async def completed(value: Any) -> Any:
    """Return a value; a coroutine or future is awaited for its result."""
    return await value if hasattr(value, "__await__") else value


def in_background(
    name: str, function: Callable[[], Any], call_soon: Callable[[Job], None]
) -> Future:
    """Call a function that waits on a thread of its own, and return a future of its result.

    ``call_soon`` passes a function to the executor, which completes the future.
    """
    future = Future()

    def call() -> None:
        try:
            result = function()
        except RoszError as error:
            failure = error
            call_soon(lambda: future.set_exception(failure))
        else:
            call_soon(lambda: future.set_result(result))

    # Not a `Worker`, which is bounded: any number of calls may wait, each without a limit.
    threading.Thread(target=call, name=name, daemon=True).start()
    return future


_global = SingleThreadedExecutor()


def get_global_executor() -> Executor:
    """Return the executor that is used when none is given."""
    return _global


def _deadline(timeout: float | None) -> float | None:
    """Return the end of a wait; None for negative and missing timeouts, as in rclpy."""
    return None if timeout is None or timeout < 0 else time.monotonic() + clamp_timeout(timeout)
