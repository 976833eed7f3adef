"""rclpy.executors: who calls the callbacks.

What comes from the network waits in its entity (subscription, service, …) and rings a bell. The
executor then asks its nodes' entities for what is ready, and runs that: all of it, each once,
before it asks again, so that none is starved.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Protocol, Self

from rosz.errors import RoszError
from rosz.ros2.rclpy import state
from rosz.ros2.rclpy.task import Future, Task
from rosz.session import clamp_timeout

if TYPE_CHECKING:
    from types import TracebackType

    from rosz.ros2.rclpy.callback_groups import CallbackGroup
    from rosz.ros2.rclpy.context import Context

__all__ = (
    "Entity",
    "Executor",
    "ExternalShutdownException",
    "MultiThreadedExecutor",
    "ShutdownException",
    "SingleThreadedExecutor",
    "TimeoutException",
)

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


class Entity(Protocol):
    """What has callbacks.

    Attributes:
        callback_group: The group that they are of.
    """

    callback_group: CallbackGroup

    def take(self) -> Callable[[], Any] | None:
        """Return what to call next, if something is ready."""


class Executor:
    """Calls what is ready; base of those that do it on one or on several threads.

    Args:
        context: Whose end ends it; the default one when not given.
    """

    def __init__(self, *, context: Context | None = None) -> None:
        self.context = context or state.default_context()
        self._nodes: list[Any] = []
        self._bell = threading.Event()
        self._soon: deque[Job] = deque()
        self._ready: deque[tuple[Job, CallbackGroup]] = deque()
        self._is_shutdown = False
        self.context.on_shutdown(self.wake)

    def add_node(self, node: Any) -> bool:
        """Take on the callbacks of a node; tell whether it is a new one."""
        if node in self._nodes:
            return False
        self._nodes = [*self._nodes, node]
        node.executor = self
        self.wake()
        return True

    def remove_node(self, node: Any) -> None:
        """Leave the callbacks of a node alone from now on."""
        self._nodes = [one for one in self._nodes if one is not node]
        if node.executor is self:
            node.executor = None

    def get_nodes(self) -> list[Any]:
        """Return the nodes whose callbacks it calls."""
        return list(self._nodes)

    def wake(self) -> None:
        """Have it look at what is ready; from any thread."""
        self._bell.set()

    def call_soon(self, job: Job) -> None:
        """Have a function called among the callbacks; from any thread."""
        self._soon.append(job)
        self.wake()

    def create_task(self, callback: Callable[..., Any], *args: Any, **kwargs: Any) -> Task:
        """Have a function, or a coroutine function, run among the callbacks."""
        task = Task(callback, args, kwargs, executor=self)
        self.call_soon(task.step)
        return task

    def spin(self) -> None:
        """Call what is ready until the executor or its context is shut down.

        Raises:
            ExternalShutdownException: A signal shut the context down.
        """
        while self.context.ok() and not self._is_shutdown:
            self.spin_once()
        if self.context.ended_by_signal:
            raise ExternalShutdownException

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait until something is ready, and call one callback.

        Args:
            timeout_sec: Seconds to wait at most; for ever when not given.

        Raises:
            ExternalShutdownException: A signal shut the context down.
        """
        self._once(timeout_sec, lambda: False)

    def spin_until_future_complete(self, future: Future, timeout_sec: float | None = None) -> None:
        """Call what is ready until a future is done.

        Args:
            future: It.
            timeout_sec: Seconds after which to give up; never when not given.
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
        """Call one callback unless a future is done before; see `spin_once`."""
        future.add_done_callback(lambda _: self.wake())
        self._once(timeout_sec, future.done)

    def shutdown(self, timeout_sec: float | None = None) -> bool:  # noqa: ARG002  # rclpy's
        """End all spinning."""
        self._is_shutdown = True
        self.wake()
        return True

    def _once(self, timeout: float | None, enough: Callable[[], bool]) -> None:
        deadline = _deadline(timeout)
        while self.context.ok() and not self._is_shutdown and not enough():
            self._bell.clear()
            found = self._next()
            if found is not None:
                self._run(*found)
                return
            left = None if deadline is None else deadline - time.monotonic()
            if left is not None and left <= 0:
                return
            self._bell.wait(left)
        if self.context.ended_by_signal:
            raise ExternalShutdownException

    def _next(self) -> tuple[Job, CallbackGroup | None] | None:
        """Return what to run next; its group has been entered."""
        if self._soon:
            return self._soon.popleft(), None
        if not self._ready:
            self._ready.extend(self._collect(self._entities()))
        return self._ready.popleft() if self._ready else None

    def _entities(self) -> Iterable[Entity]:
        for node in self._nodes:
            yield from node.rosz_entities()

    def _collect(self, entities: Iterable[Entity]) -> Iterable[tuple[Job, CallbackGroup]]:
        for entity in entities:
            group = entity.callback_group
            if not self._may_enter(group):
                continue
            call = entity.take()
            if call is None:
                self._left(group)
                continue
            yield Task(call, executor=self).step, group

    def _may_enter(self, _group: CallbackGroup) -> bool:
        """Begin a callback of a group; on one thread callbacks exclude each other anyway."""
        return True

    def _left(self, group: CallbackGroup) -> None:
        """Take note that a callback of a group has ended."""

    def _run(self, job: Job, group: CallbackGroup | None) -> None:
        try:
            job()
        finally:
            if group is not None:
                self._left(group)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.shutdown()


class SingleThreadedExecutor(Executor):
    """Calls one callback at a time, on the thread that spins."""


class MultiThreadedExecutor(Executor):
    """Calls callbacks on several threads, as far as their groups let them.

    Args:
        num_threads: How many.
        context: Whose end ends it.
    """

    def __init__(self, num_threads: int | None = None, *, context: Context | None = None) -> None:
        super().__init__(context=context)
        self._pool = ThreadPoolExecutor(num_threads or _THREADS, thread_name_prefix="rosz-executor")
        self._failed: deque[BaseException] = deque()

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """End all spinning, and wait for what is running."""
        super().shutdown(timeout_sec)
        self._pool.shutdown(wait=timeout_sec is None, cancel_futures=True)
        return True

    def _may_enter(self, group: CallbackGroup) -> bool:
        return group.enter()

    def _left(self, group: CallbackGroup) -> None:
        group.leave()

    def _run(self, job: Job, group: CallbackGroup | None) -> None:
        def work() -> None:
            try:
                job()
            except BaseException as error:  # noqa: BLE001  # raised where it is spun
                self._failed.append(error)
            finally:
                if group is not None:
                    self._left(group)
                self.wake()

        self._pool.submit(work)
        if self._failed:
            raise self._failed.popleft()

    def _next(self) -> tuple[Job, CallbackGroup | None] | None:
        if self._failed:
            raise self._failed.popleft()
        return super()._next()


def _deadline(timeout: float | None) -> float | None:
    """Return when a wait ends; negative and missing timeouts mean never, as in rclpy."""
    return None if timeout is None or timeout < 0 else time.monotonic() + clamp_timeout(timeout)
