"""A queue that is bounded by the number of its items and by their sizes."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import Generic, TypeVar

T = TypeVar("T")


class BoundedQueue(Generic[T]):
    """A queue whose oldest items make room for new ones; the newest item always stays.

    It has no lock: whoever uses it from several threads holds one around each call.

    Args:
        most: Largest number of items; 0 for no limit.
        most_bytes: Largest total size; 0 for no limit.

    Attributes:
        most: As given; a new value holds from the next `put` on.
        most_bytes: As given; a new value holds from the next `put` on.
        size: Total size of the items.
        dropped: Number of items that made room for others.
    """

    __slots__ = ("_items", "dropped", "most", "most_bytes", "size")

    def __init__(self, most: int = 0, most_bytes: int = 0) -> None:
        self.most = most
        self.most_bytes = most_bytes
        self.size: int = 0
        self.dropped: int = 0
        self._items: deque[tuple[int, T]] = deque()

    def put(self, item: T, size: int = 0) -> Sequence[T]:
        """Add an item, and drop the oldest ones if there are too many.

        Args:
            item: The item.
            size: Its size, usually in bytes.

        Returns:
            The items that were dropped, the oldest first.
        """
        items = self._items
        items.append((size, item))
        self.size += size
        if not (self._is_over() and len(items) > 1):
            return ()
        dropped = []
        while self._is_over() and len(items) > 1:
            dropped.append(self.pop())
        self.dropped += len(dropped)
        return dropped

    def _is_over(self) -> bool:
        return bool(
            (self.most and len(self._items) > self.most)
            or (self.most_bytes and self.size > self.most_bytes)
        )

    def pop(self) -> T:
        """Remove and return the oldest item.

        Raises:
            IndexError: The queue is empty.
        """
        size, item = self._items.popleft()
        self.size -= size
        return item

    def clear(self) -> None:
        """Remove all items, which do not count as dropped."""
        self._items.clear()
        self.size = 0

    @property
    def oldest(self) -> T:
        """The oldest item.

        Raises:
            IndexError: The queue is empty.
        """
        return self._items[0][1]

    def __len__(self) -> int:
        return len(self._items)

    def __iter__(self) -> Iterator[T]:
        """Iterate over the items, the oldest first."""
        return (item for _, item in self._items)
