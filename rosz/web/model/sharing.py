"""Something that is open only while somebody uses it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from rosz.lifecycle import Closable

T = TypeVar("T", bound=Closable)


class Use(Generic[T]):
    """The use of something shared, until it is closed."""

    def __init__(self, shared: SharedResource[T], value: T) -> None:
        self._shared: SharedResource[T] | None = shared
        self.value = value

    def close(self) -> None:
        """End the use; a second call has no effect."""
        shared, self._shared = self._shared, None
        if shared is not None:
            shared.release()


class SharedResource(Generic[T]):
    """Something that the first user opens, by a function, and the last one closes."""

    def __init__(self, open_one: Callable[[], T]) -> None:
        self._open = open_one
        self._lock = threading.Lock()
        self._value: T | None = None
        self._users = 0

    def use(self) -> Use[T]:
        """Open it, unless it is open, and count a user.

        Raises:
            RoszError: It cannot be opened.
        """
        with self._lock:
            if self._value is None:
                self._value = self._open()
            self._users += 1
            return Use(self, self._value)

    def release(self) -> None:
        """Count one user less, and close it after the last one."""
        with self._lock:
            self._users -= 1
            if self._users:
                return
            value, self._value = self._value, None
        if value is not None:
            value.close()
