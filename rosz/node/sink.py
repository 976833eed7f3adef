"""What the places that a log goes to have in common."""

from __future__ import annotations

import logging
from abc import abstractmethod
from collections import deque
from collections.abc import Callable

__all__ = ("Sink",)


class Sink(logging.Handler):
    """A handler that never raises into the program, and bears a signal handler that logs.

    Such a handler may run in the midst of a write of the same thread; its record waits until that
    is done.

    Args:
        on_trouble: Told, in a sentence, when records are lost. It must not log at once, because
            the sink is locked meanwhile.
    """

    def __init__(self, on_trouble: Callable[[str], object]) -> None:
        super().__init__()
        self._on_trouble = on_trouble
        self._busy = False
        self._waiting: deque[logging.LogRecord] = deque()

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record out, and those that came meanwhile."""
        self._waiting.append(record)
        if self._busy:
            return
        self._busy = True
        try:
            while self._waiting:
                self._write(self._waiting.popleft())
        except Exception:  # noqa: BLE001  # what logging does with errors of any handler
            self.handleError(record)
        finally:
            self._busy = False

    @abstractmethod
    def _write(self, record: logging.LogRecord) -> None:
        """Write one record out."""
