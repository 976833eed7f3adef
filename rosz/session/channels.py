"""Channels, in which what arrives waits until a thread of Python receives it.

No Python runs on the threads of Zenoh. A link would wait for Python's lock there. To undeclare an
advanced publisher, Zenoh waits for its own threads while it holds that lock. And the interpreter
aborts at its end when a foreign thread asks for it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any, Protocol, TypeVar

import zenoh

from rosz.worker import Worker

__all__ = ("Channel", "declare", "declare_rare", "open_channel", "waits_in_zenoh")

T = TypeVar("T")

_CHANNEL_SIZE = 1 << 20
"""Capacity of a channel: more items than ever arrive before a thread of Python receives them."""


class Channel(Protocol):
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


def declare(declaring: Callable[[Any], T]) -> tuple[T, Channel]:
    """Declare something for which many items arrive.

    Args:
        declaring: Function that declares it with a handler.

    Returns:
        The object of Zenoh, and the channel of the items.
    """
    entity: Any = declaring(open_channel())
    return entity, entity.handler


def declare_rare(declaring: Callable[[Any], T]) -> tuple[T, Channel]:
    """Declare something for which items arrive rarely: a thread that waits for them sleeps.

    A thread of Python that Zenoh starts puts the items in the channel. Its link waits when 256 of
    them have arrived while other threads hold Python's lock, so this is not for data.

    Args:
        declaring: Function that declares it with a handler.

    Returns:
        The object of Zenoh, and the channel of the items.
    """
    if not threading.main_thread().is_alive():  # Zenoh might not be able to start its thread
        return declare(declaring)
    channel = _RareChannel()
    # The thread is a daemon, which the end of the program does not wait for, if that of its
    # declaration is one.
    if threading.current_thread().daemon:
        return declaring(channel.handler), channel
    made: SimpleQueue[tuple[T | None, BaseException | None]] = SimpleQueue()

    def run() -> None:
        try:
            made.put((declaring(channel.handler), None))
        except BaseException as error:  # noqa: BLE001  # the caller raises it
            made.put((None, error))

    _daemons.submit(run)
    entity, error = made.get()
    if error is not None:
        raise error
    return entity, channel  # type: ignore[return-value]  # there is one without an error


def waits_in_zenoh(channel: Channel) -> bool:
    """Return whether a thread that receives from a channel waits inside Zenoh.

    One that waits elsewhere has to go on until the channel is closed, also while the program ends:
    only then has the thread of Zenoh that fills it left Python.
    """
    return not isinstance(channel, _RareChannel)


class _RareChannel:
    """A queue that a callback of Zenoh fills.

    Neither function of the callback is one of Python: once its thread has closed the channel, it
    does not ask for Python's lock any more.

    Attributes:
        handler: The handler to declare something with.
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


_daemons: Worker[Callable[[], object]] = Worker("rosz-declare", threads=8)
"""Threads to declare something on."""
