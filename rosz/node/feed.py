"""The queue of a subscription: the newest samples, and those who wait for them."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosz.errors import ClosedError, WaitTimeout
from rosz.node.channel import Taken
from rosz.session import LONGEST_WAIT, clamp_timeout

if TYPE_CHECKING:
    from rosz.session import Reply, Sample

__all__ = ("Feed", "Handler", "Take")

Take = Callable[[Any], "Taken | None"]
"""Decodes a sample; ``None`` for one to leave out."""

Handler = Callable[[Take, Any], None]
"""Gets a sample with what decodes it, and must not raise."""


class Feed:
    """A ring of samples, each with what decodes it when its turn comes.

    A lock serves as the bell: it is locked while nothing new came, and who waits for it wakes when
    it is released. That takes a fraction of what a condition does, on a path that every sample
    goes. Who leaves something for others to take, or finds the end, rings on.

    Args:
        name: Of the topic, for errors.
        depth: Newest so many samples are kept.
    """

    def __init__(self, name: str, depth: int) -> None:
        self._name = name
        self._ring: deque[tuple[Take, Sample | Reply]] = deque(maxlen=depth)
        self._bell = threading.Lock()
        self._bell.acquire()
        self._turn = threading.RLock()
        self._loops: tuple[Callable[[], None], ...] = ()
        self.closed = False

    def put(self, take: Take, sample: Sample | Reply) -> None:
        """Take a sample in; called on Zenoh's threads, so it neither blocks nor raises."""
        self._ring.append((take, sample))
        self._ring_bell()

    def _ring_bell(self) -> None:
        if self._bell.locked():
            # Another thread may wake the dispatcher between the look and the release.
            with suppress(RuntimeError):
                self._bell.release()
        for wake in self._loops:
            wake()

    def run(self, handle: Handler) -> None:
        """Hand samples over until closed; the work of a dispatch thread."""
        while not self.closed:
            self._bell.acquire()
            while not self.closed:
                try:
                    take, sample = self._ring.popleft()
                except IndexError:
                    break
                handle(take, sample)
        self._ring_bell()

    def _pop(self) -> Taken | None:
        with self._turn:  # decoding numbers the samples, and drops those that come late
            try:
                take, sample = self._ring.popleft()
            except IndexError:  # somebody else was faster
                return None
            return take(sample)

    def get(self, timeout: float) -> Any:
        """Return the oldest message, waiting for one.

        Raises:
            WaitTimeout: None came in time.
            ClosedError: The feed was closed meanwhile.
            UsageError: The timeout is no number.
        """
        deadline = time.monotonic() + clamp_timeout(timeout)
        while True:
            while self._ring and not self.closed:
                taken = self._pop()
                if taken is not None:
                    if self._ring:
                        self._ring_bell()
                    return taken[0]
            if self.closed:
                self._ring_bell()
                raise ClosedError(f"the subscription of '{self._name}' is closed")
            left = deadline - time.monotonic()
            if left <= 0:
                raise WaitTimeout(f"message on '{self._name}'", timeout)
            self._bell.acquire(timeout=left)

    def __iter__(self) -> Iterator[Any]:
        """Yield messages until closed."""
        while True:
            try:
                message = self.get(LONGEST_WAIT)
            except ClosedError:
                return
            yield message

    async def __aiter__(self) -> AsyncIterator[Any]:
        """Yield messages in an asyncio program until closed."""
        import asyncio  # a third of what a node would load, for the few that use it

        loop = asyncio.get_running_loop()
        arrived = asyncio.Event()

        def wake() -> None:
            try:
                loop.call_soon_threadsafe(arrived.set)
            except RuntimeError:  # the loop has ended, and nobody comes back for more
                self._forget(wake)

        self._loops = (*self._loops, wake)
        try:
            while not self.closed:
                arrived.clear()
                while self._ring and not self.closed:
                    taken = self._pop()
                    if taken is not None:
                        yield taken[0]
                if not self.closed:
                    await arrived.wait()
        finally:
            self._forget(wake)

    def _forget(self, wake: Callable[[], None]) -> None:
        self._loops = tuple(other for other in self._loops if other is not wake)

    def close(self) -> None:
        """End all waits on it; again is no error."""
        self.closed = True
        self._ring_bell()
