"""Bounds, in bytes, of the messages that wait to be written."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

__all__ = ("ROW_BYTES", "Buffer", "Channels")

T = TypeVar("T")

ROW_BYTES = 400
"""Bytes of memory that a message takes beside its payload while it waits."""
_COLLECT_SECONDS = 0.01
"""Time to wait for more after the first item, as waking a thread for each takes longer than
writing it."""
_SMALL_CHANNEL = 4 << 20
"""Bytes that may wait in the channel of a topic with small messages; they are not counted."""
_LEAST = 8
"""Messages of a topic that may wait in its channel however large they are."""


class Buffer(Generic[T]):
    """A queue that is bounded by bytes: the oldest items make room for new ones.

    Args:
        limit: Largest size in bytes; 0 for no limit.
        elsewhere: Function that returns the bytes that wait in other places and count as well.

    Attributes:
        size: Bytes of the items.
    """

    def __init__(self, limit: int, elsewhere: Callable[[], int] = lambda: 0) -> None:
        self._limit = limit
        self._elsewhere = elsewhere
        self._items: deque[tuple[int, T]] = deque()
        self._changed = threading.Condition()
        self._ended = threading.Event()
        self.size: int = 0

    def put(self, item: T, size: int) -> int:
        """Add an item; never wait.

        Args:
            item: The item.
            size: Bytes of its payload.

        Returns:
            The number of oldest items that were dropped.
        """
        size += ROW_BYTES
        dropped = 0
        with self._changed:
            items = self._items
            items.append((size, item))
            self.size += size
            if self._limit:
                most = self._limit - self._elsewhere()
                while self.size > most and len(items) > 1:
                    self.size -= items.popleft()[0]
                    dropped += 1
            if len(items) == 1:
                self._changed.notify()
        return dropped

    def take(self) -> T | None:
        """Wait for an item, and return the oldest; ``None`` at the end."""
        if not self._items:
            with self._changed:
                self._changed.wait_for(lambda: self._items or self._ended.is_set())
            self._ended.wait(_COLLECT_SECONDS)
        with self._changed:
            if not self._items:
                return None
            size, item = self._items.popleft()
            self.size -= size
            return item

    def close(self) -> None:
        """End it, once what waits has been taken; a second call has no effect."""
        self._ended.set()
        with self._changed:
            self._changed.notify_all()


class Channels:
    """The capacity of each topic's Zenoh channel, so that all together keep to a bound.

    Topics with large messages share a number of bytes. Sizes and numbers are rounded, so that they
    change rarely.

    Args:
        limit: The bytes that they share.
        depth: Largest number of messages in a channel.

    Attributes:
        size: Bytes that may wait in the channels of topics with large messages.
    """

    def __init__(self, limit: int, depth: int) -> None:
        self._limit = limit
        self._depth = depth
        self._lock = threading.Lock()
        self._largest: dict[str, int] = {}
        self._share = limit
        self.size: int = 0

    def fit(self, topic: str, size: int) -> int:
        """Return how many messages may wait in the channel of a topic.

        Args:
            topic: The topic.
            size: Bytes of one of its messages.
        """
        largest = self._largest.get(topic, 0)
        if size > largest:
            with self._lock:
                # To an eighth more at most: images of 1 MB have some bytes more than 1 MB.
                step = 1 << max(size.bit_length() - 4, 0)
                largest = self._largest[topic] = -(-size // step) * step
                large = [one for one in self._largest.values() if self._is_large(one)]
                self._share = self._limit // max(len(large), 1)
                self.size = sum(one * self._fitting(one) for one in large)
        return self._fitting(largest) if self._is_large(largest) else self._depth

    def _is_large(self, size: int) -> bool:
        return size * self._depth > _SMALL_CHANNEL

    def _fitting(self, size: int) -> int:
        count = self._share // size
        step = 1 << max(count.bit_length() - 2, 0)
        return min(max(count // step * step, _LEAST), self._depth)
