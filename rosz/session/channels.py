"""Channels, in which arrived items wait until a thread of Python receives them.

No Python runs on the threads of Zenoh. A link would wait for Python's lock there. To undeclare an
advanced publisher, Zenoh waits for its own threads while it holds that lock. And the interpreter
aborts at its end when a foreign thread asks for it.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any, Protocol, TypeVar

import zenoh

from rosz.program import current, within
from rosz.session.at_exit import OPEN
from rosz.worker import lend_thread

T = TypeVar("T")

_CHANNEL_SIZE = 1 << 20
"""Capacity of a channel: more items than ever arrive before a thread of Python receives them."""


class ItemChannel(Protocol):
    """Where threads of Python receive items."""

    def recv(self) -> Any:
        """Wait for an item and return it.

        Raises:
            zenoh.ZError: The channel is closed.
        """

    def try_recv(self) -> Any:
        """Return an item, or None if there is none.

        Raises:
            zenoh.ZError: The channel is closed.
        """


def open_channel() -> Any:
    """Return a handler for many items: a channel of Zenoh.

    A thread that waits in it wakes ten times a second, to look for signals. No two declarations
    share one.
    """
    return zenoh.handlers.FifoChannel(_CHANNEL_SIZE)


def declare(declaring: Callable[[Any], T]) -> tuple[T, ItemChannel]:
    """Declare something for which many items arrive.

    Args:
        declaring: Function that declares it with a handler.

    Returns:
        The object of Zenoh, and the channel of the items.
    """
    entity: Any = declaring(open_channel())
    return entity, entity.handler


def declare_rare(declaring: Callable[[Any], T]) -> tuple[T, ItemChannel]:
    """Declare something for which items arrive rarely: a thread that waits for them sleeps.

    A thread of Python that Zenoh starts puts the items in the channel. Its link waits when 256 of
    them have arrived while other threads hold Python's lock, so this is not for data. Arguments and
    result are those of `declare`.
    """
    if not threading.main_thread().is_alive():  # Zenoh might not be able to start its thread
        return declare(declaring)
    channel = _RareChannel()
    return _declare_on_daemon(declaring, channel.handler), channel


def declare_callback(declaring: Callable[[Any], T]) -> tuple[T, ItemChannel | CallbackQueue]:
    """Declare something for which items arrive rarely: no thread waits for them.

    The limits of `declare_rare` apply.

    Args:
        declaring: Function that declares it with a handler.

    Returns:
        The object of Zenoh, and the queue of the items; a channel while the program ends.
    """
    if not threading.main_thread().is_alive():
        return declare(declaring)
    queue = CallbackQueue()
    OPEN.add(queue)
    try:
        return _declare_on_daemon(declaring, queue.handler), queue
    except BaseException:
        OPEN.discard(queue)
        raise


def _declare_on_daemon(declaring: Callable[[Any], T], handler: Any) -> T:
    """Declare something on a thread that is a daemon.

    Then the thread that Zenoh starts is one, too, which the end of the program does not wait for.
    """
    if threading.current_thread().daemon:
        return declaring(handler)
    made: SimpleQueue[tuple[T | None, BaseException | None]] = SimpleQueue()

    def run() -> None:
        try:
            made.put((declaring(handler), None))
        except BaseException as error:  # noqa: BLE001  # the caller raises it
            made.put((None, error))

    if not lend_thread(run):
        run()
    entity, error = made.get()
    if error is not None:
        raise error
    return entity  # type: ignore[return-value]  # there is one without an error


class _RareChannel:
    """A queue that a callback of Zenoh fills.

    Neither function of the callback is one of Python: once its thread has closed the channel, it
    does not ask for Python's lock any more.
    """

    def __init__(self) -> None:
        self._items: SimpleQueue[Any] = SimpleQueue()
        put = self._items.put
        self.handler: Any = zenoh.handlers.Callback(put, partial(put, None), indirect=True)

    def recv(self) -> Any:
        return self._check(self._items.get())

    def try_recv(self) -> Any:
        with suppress(Empty):
            return self._check(self._items.get_nowait())
        return None

    def _check(self, item: Any) -> Any:
        if item is None:
            self._items.put(None)  # for the other threads, and the next call
            raise zenoh.ZError("the channel is closed")
        return item


class CallbackQueue:
    """A queue that Zenoh fills, and a function that handles the items on a thread that is lent.

    The function runs on one thread at a time. If no thread can be lent, it runs on the thread that
    adds the items.
    """

    def __init__(self) -> None:
        self._items: deque[Any] = deque()
        # One item while no thread handles the queue. A thread has to pop it before it does.
        self._unhandled: deque[bool] = deque()
        self._handle: Callable[[], object] = self._items.clear
        self._program = current()

    @property
    def handler(self) -> Any:
        """A handler to declare something with."""
        return zenoh.handlers.Callback(self._add, partial(OPEN.discard, self), indirect=True)

    def handle_with(self, handle: Callable[[], object], *, at_once: bool) -> None:
        """Handle the items from now on.

        Args:
            handle: Function that takes all items; it is called again when more have come.
            at_once: Whether it is called before any item has come.
        """
        self._handle = handle
        self._unhandled.append(True)
        if at_once or self._items:
            self._wake()

    def take(self) -> Any:
        """Return the oldest item and remove it; None if there is none."""
        try:
            return self._items.popleft()
        except IndexError:
            return None

    def _add(self, item: Any) -> None:
        self._items.append(item)
        del item
        self._wake()

    def _wake(self) -> None:
        if self._begin() and not lend_thread(self._run):
            self._run()

    def _begin(self) -> bool:
        try:
            return self._unhandled.pop()
        except IndexError:
            return False

    def _run(self) -> None:
        with within(self._program):
            while True:
                try:
                    self._handle()
                finally:
                    self._unhandled.append(True)
                if not self._items or not self._begin():
                    return
