"""Channels, in which arrived items wait until a thread of Python receives them.

Python runs on the threads of Zenoh for rare items only, and only to put them into a queue: a link
waits there for Python's lock, up to 5 ms for each item where other threads of Python are busy.
"""

from __future__ import annotations

import operator
from collections import deque
from collections.abc import Callable
from functools import partial
from queue import SimpleQueue
from typing import Any, TypeVar

import zenoh

from rosz.session.at_exit import OPEN
from rosz.worker import Serial

T = TypeVar("T")

_CHANNEL_SIZE = 1 << 20
"""Capacity of a channel: more items than ever arrive before a thread of Python receives them."""


def open_channel() -> Any:
    """Return a handler for many items: a channel of Zenoh.

    A thread that waits in it wakes ten times a second, to look for signals. No two declarations
    share one.
    """
    return zenoh.handlers.FifoChannel(_CHANNEL_SIZE)


def declare(declaring: Callable[[Any], T]) -> tuple[T, Any]:
    """Declare something for which many items arrive, by a function that takes a handler.

    Returns:
        The object of Zenoh, and the channel of the items, with ``recv`` and ``try_recv``.
    """
    entity: Any = declaring(open_channel())
    return entity, entity.handler


def declare_callback(
    declaring: Callable[[Any], T], depth: int | None = None
) -> tuple[T, CallbackQueue]:
    """Declare something whose items the threads of Zenoh put into a queue; no thread waits.

    The interpreter aborts at its end when a thread of Zenoh asks for Python's lock. So the program
    waits until Zenoh has dropped the handler, which calls functions written in C then: with a
    function in Python, the thread could release the lock in between, and ask for it again.

    Args:
        declaring: Function that declares it with a handler.
        depth: The number of items to keep, if a new one is to replace the oldest.

    Returns:
        The object of Zenoh, and the queue of the items.
    """
    queue = CallbackQueue(depth)
    OPEN.add(queue)
    at_end = partial(queue.ended.put, None), partial(OPEN.discard, queue)
    end = partial(any, map(operator.call, at_end))
    try:
        return declaring(zenoh.handlers.Callback(queue.put, end, indirect=False)), queue
    except BaseException:
        OPEN.discard(queue)
        raise


class CallbackQueue:
    """A queue, and a function that handles its items on a thread that is lent.

    Args:
        depth: The number of items to keep; ``None`` for all.

    Attributes:
        depth: As given; a new value holds from the next item on.
        ended: Gets one item when no more can come.
    """

    def __init__(self, depth: int | None = None) -> None:
        self.depth = depth
        self.ended: SimpleQueue[None] = SimpleQueue()
        self._items: deque[Any] = deque()
        self._serial: Serial | None = None

    def handle_with(self, serial: Serial, *, at_once: bool = False) -> None:
        """Handle the items from now on.

        Args:
            serial: What takes all items.
            at_once: Whether it begins before any item has come.
        """
        self._serial = serial
        if at_once or self._items:
            serial.wake()

    def take(self) -> Any:
        """Return the oldest item and remove it; None if there is none."""
        try:
            return self._items.popleft()
        except IndexError:
            return None

    def put(self, item: Any) -> None:
        """Add an item."""
        items, depth = self._items, self.depth
        items.append(item)
        while depth is not None and len(items) > depth:
            self.take()
        if self._serial is not None:
            self._serial.wake()
