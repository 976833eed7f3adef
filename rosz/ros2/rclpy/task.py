"""rclpy.task: results that come later, and callbacks that wait for them."""

from __future__ import annotations

import inspect
import threading
from collections.abc import Callable, Coroutine, Generator
from typing import Any

__all__ = ("Future", "Task")

Schedule = Callable[[Callable[[], object]], object]
"""Has a function called by an executor."""


class Future:
    """A result that comes later.

    Args:
        executor: Who runs the callbacks that wait for it; whoever sets the result when not given.
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
        """Tell whether there is a result, or never will be one."""
        return self._done or self._cancelled

    def cancelled(self) -> bool:
        """Tell whether it was given up."""
        return self._cancelled

    def cancel(self) -> None:
        """Give it up, unless it is done."""
        with self._lock:
            if self._done:
                return
            self._cancelled = True
        self._tell()

    def result(self) -> Any:
        """Return the result, None while there is none.

        Raises:
            Exception: What went wrong, where something did.
        """
        if self._exception is not None:
            raise self._exception
        return self._result

    def exception(self) -> BaseException | None:
        """Return what went wrong; None if nothing did, or not yet."""
        return self._exception

    def set_result(self, result: Any) -> None:
        """Set the result, and call who waits for it."""
        self._set(result, None)

    def set_exception(self, exception: BaseException) -> None:
        """Set what went wrong, and call who waits for the result."""
        self._set(None, exception)

    def _set(self, result: Any, exception: BaseException | None) -> None:
        with self._lock:
            self._result, self._exception = result, exception
            self._done = True
        self._tell()

    def add_done_callback(self, callback: Callable[[Any], object]) -> None:
        """Have a function called with this when it is done; soon if it is already."""
        with self._lock:
            if not self.done():
                self._callbacks.append(callback)
                return
        self._call(callback)

    def _tell(self) -> None:
        with self._lock:
            callbacks, self._callbacks = self._callbacks, []
        for callback in callbacks:
            self._call(callback)

    def _call(self, callback: Callable[[Any], object]) -> None:
        if self._executor is None:
            callback(self)
        else:
            self._executor.call_soon(lambda: callback(self))

    def __await__(self) -> Generator[Future, None, Any]:
        while not self.done():
            yield self
        return self.result()


class Task(Future):
    """A function that an executor runs, and that may wait for futures on its way.

    Args:
        handler: The function, or a coroutine function.
        args: Its arguments.
        kwargs: Its keyword arguments.
        executor: Who runs it.
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
        """Run it up to where it has to wait, or to its end; what it raises goes on, too."""
        if self.done():
            return
        try:
            if self._coroutine is None:
                result = self._start()
                if not inspect.iscoroutine(result):
                    self.set_result(result)
                    return
                self._coroutine = result
            waits_for = self._coroutine.send(None)
        except StopIteration as stop:
            self.set_result(stop.value)
        except BaseException as error:
            self.set_exception(error)
            raise
        else:
            if isinstance(waits_for, Future):
                waits_for.add_done_callback(lambda _: self._executor.call_soon(self.step))
            else:
                self._executor.call_soon(self.step)
