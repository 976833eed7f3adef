"""rclpy.callback_groups: which callbacks may run at the same time.

It matters only to an executor with several threads.
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod

__all__ = ("CallbackGroup", "MutuallyExclusiveCallbackGroup", "ReentrantCallbackGroup")


class CallbackGroup(ABC):
    """A set of callbacks."""

    @abstractmethod
    def enter(self) -> bool:
        """Begin a callback of the group, if it may run now; tell whether it may."""

    @abstractmethod
    def leave(self) -> None:
        """Take note that a callback of the group has ended."""


class ReentrantCallbackGroup(CallbackGroup):
    """Callbacks that may all run at the same time."""

    def enter(self) -> bool:
        """Begin a callback."""
        return True

    def leave(self) -> None:
        """Do nothing."""


class MutuallyExclusiveCallbackGroup(CallbackGroup):
    """Callbacks of which one runs at a time."""

    def __init__(self) -> None:
        self._running = threading.Lock()

    def enter(self) -> bool:
        """Begin a callback unless another one runs."""
        return self._running.acquire(blocking=False)

    def leave(self) -> None:
        """Let the next one run."""
        self._running.release()
