"""One thread that waits for many sockets, and streams whose queues are bounded."""

from __future__ import annotations

import heapq
import itertools
import logging
import selectors
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial

from rosz.errors import RoszError
from rosz.worker import Worker

log = logging.getLogger("rosz.ros1")

_MAX_QUEUED = 64 << 20
"""Bytes that wait to be sent on one stream; of more, the oldest messages are dropped. Where none
may be dropped, the stream is closed."""

_WAKE = b"\0"
_KEEPALIVE = (("TCP_KEEPIDLE", 5), ("TCP_KEEPINTVL", 2), ("TCP_KEEPCNT", 3))
"""Seconds and probes after which a peer whose machine has gone counts as gone."""


class Handler:
    """The receiver of a stream; its methods are called on the thread of the loop.

    A subclass that does not define `received` or `closed` does nothing then.
    """

    def space(self) -> memoryview:
        """Return where the next bytes belong; never empty."""
        raise NotImplementedError

    def received(self, count: int) -> None:
        """Handle bytes that were put there; a `RoszError` is logged and closes the stream."""

    def closed(self) -> None:
        """Handle the end of the stream."""


class SocketLoop:
    """The thread that reads from all sockets of a bridge, and writes messages that had to wait."""

    def __init__(self, name: str) -> None:
        self._selector = selectors.DefaultSelector()
        self._waker, self._wakened = socket.socketpair()
        self._waker.setblocking(False)
        self._wakened.setblocking(False)
        self._selector.register(self._wakened, selectors.EVENT_READ, self._drain)
        self._tasks: deque[Callable[[], object]] = deque()
        self._timers: list[tuple[float, int, Callable[[], object]]] = []
        self._numbers = itertools.count()
        self._closing = False
        self._worker = Worker[Callable[[], object]](name, receive=self._next, logger=log)

    def call(self, task: Callable[[], object]) -> None:
        """Call a function on the thread of the loop, soon."""
        self._tasks.append(task)
        with suppress(BlockingIOError, OSError):  # it will wake anyway; or it is closed
            self._waker.send(_WAKE)

    def later(self, seconds: float, task: Callable[[], object]) -> None:
        """Call a function on the thread of the loop after a time in seconds."""
        entry = (time.monotonic() + seconds, next(self._numbers), task)
        self.call(lambda: heapq.heappush(self._timers, entry))

    def watch(self, sock: socket.socket, events: int, ready: Callable[[int], object]) -> None:
        """Call a function when a socket is ready; only on the thread of the loop.

        Args:
            sock: The socket.
            events: ``selectors.EVENT_READ`` and ``EVENT_WRITE``, or 0 for none any more.
            ready: Function called with the events that have come.
        """
        watched = sock.fileno() in self._selector.get_map()
        if not events:
            if watched:
                self._selector.unregister(sock)
        elif watched:
            self._selector.modify(sock, events, ready)
        else:
            self._selector.register(sock, events, ready)

    def close(self) -> None:
        """End the thread; a second call has no effect."""
        if self._closing:
            return
        self._closing = True
        self.call(lambda: None)
        self._worker.close()
        self._selector.close()
        self._waker.close()
        self._wakened.close()

    def _next(self) -> Callable[[], object] | None:
        while not self._tasks:
            if self._closing:
                return None
            wait = None
            if self._timers:
                wait = self._timers[0][0] - time.monotonic()
                if wait <= 0:
                    return heapq.heappop(self._timers)[2]
            for key, events in self._selector.select(wait):
                self._tasks.append(partial(key.data, events))
        return self._tasks.popleft()

    def _drain(self, _events: int) -> None:
        with suppress(BlockingIOError):
            self._wakened.recv(4096)


class Stream:
    """A connected socket: a handler gets the received bytes, and sent messages may wait.

    Args:
        sock: The socket; the stream owns it.
        ended: Function called with the stream when it has ended, whatever its handler is then.

    Attributes:
        handler: Receives the bytes; may be replaced on the thread of the loop.
        peer: Address of the other end, for the log.
        host: Host of the other end.
        local_host: Address of this end.
        depth: Number of newest messages that wait to be sent; None for all.
    """

    def __init__(
        self,
        loop: SocketLoop,
        sock: socket.socket,
        handler: Handler,
        ended: Callable[[Stream], object] | None = None,
    ) -> None:
        self.handler = handler
        self._ended = ended
        self.host, self.peer = _name_of(sock)
        self.local_host: str = sock.getsockname()[0]
        self.depth: int | None = None
        self.received_bytes = 0
        self.sent_bytes = 0
        self._loop = loop
        self._sock = sock
        self._lock = threading.RLock()
        self._queue: deque[deque[memoryview]] = deque()
        self._queued = 0
        self._begun = False
        self._writing = False
        self._reading = True
        self._ending = False
        self._closed = False
        sock.setblocking(False)
        _set_options(sock)
        loop.call(self._watch)

    @property
    def is_closed(self) -> bool:
        """Whether the stream has ended."""
        return self._closed

    def send(self, parts: Sequence[bytes]) -> None:
        """Send a message, or queue it; any thread may."""
        with self._lock:
            if self._closed or self._ending:
                return
            if self._queue:
                self._put(parts)
                self._trim()
                return
            try:
                count = self._sock.sendmsg(parts)
            except BlockingIOError:
                count = 0
            except OSError:
                self._loop.call(self.close)
                return
            self.sent_bytes += count
            if count == sum(map(len, parts)):
                return
            self._put(parts)
            if count:
                self._cut(count)
            if not self._flush():
                self._writing = True
                self._loop.call(self._watch)

    def end(self) -> None:
        """Close the stream when everything has been sent; any thread may."""
        with self._lock:
            self._ending = True
            empty = not self._queue
        if empty:
            self._loop.call(self.close)

    def pause(self, *, reading: bool) -> None:
        """Stop receiving, or go on; only on the thread of the loop."""
        self._reading = reading
        self._watch()

    def close(self) -> None:
        """Close the socket; only on the thread of the loop; a second call has no effect."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            self._queue.clear()
        self._loop.watch(self._sock, 0, self._ready)
        self._sock.close()
        if self._ended is not None:
            self._ended(self)
        self.handler.closed()

    def _watch(self) -> None:
        if self._closed:
            return
        events = selectors.EVENT_READ if self._reading else 0
        if self._writing:
            events |= selectors.EVENT_WRITE
        self._loop.watch(self._sock, events, self._ready)

    def _ready(self, events: int) -> None:
        if self._closed:
            return
        try:
            if events & selectors.EVENT_WRITE:
                self._resume()
            if events & selectors.EVENT_READ and self._reading:
                self._receive()
        except RoszError as error:
            log.warning("closed the connection of %s: %.300s", self.peer, error)
            self.close()
        except OSError:
            self.close()

    def _receive(self) -> None:
        try:
            count = self._sock.recv_into(self.handler.space())
        except BlockingIOError:
            return
        if not count:
            self.close()
            return
        self.received_bytes += count
        self.handler.received(count)

    def _resume(self) -> None:
        with self._lock:
            if not self._flush():
                return
            self._writing = False
            ending = self._ending
        self._watch()
        if ending:
            self.close()

    def _flush(self) -> bool:
        """Send what the socket takes; return whether nothing is left. Needs the lock."""
        while self._queue:
            try:
                count = self._sock.sendmsg(self._queue[0])
            except BlockingIOError:
                return False
            except OSError:
                self._queue.clear()
                self._loop.call(self.close)
                return True
            self.sent_bytes += count
            self._cut(count)
        return True

    def _put(self, parts: Sequence[bytes]) -> None:
        """Queue a message. Needs the lock."""
        message = deque(memoryview(part) for part in parts if part)
        self._queue.append(message)
        self._queued += sum(map(len, message))

    def _cut(self, count: int) -> None:
        """Remove bytes that have been sent from the oldest message. Needs the lock."""
        message = self._queue[0]
        self._queued -= count
        while message and count >= len(message[0]):
            count -= len(message.popleft())
        self._begun = bool(message)
        if message:
            message[0] = message[0][count:]
        else:
            self._queue.popleft()

    def _trim(self) -> None:
        """Drop the oldest messages of which nothing has been sent. Needs the lock."""
        if self.depth is None:
            if self._queued > _MAX_QUEUED:
                log.warning("closed the connection of %s: it does not read its answers", self.peer)
                self._ending = True
                self._loop.call(self.close)
            return
        first = int(self._begun)
        while len(self._queue) > self.depth + first or (
            self._queued > _MAX_QUEUED and len(self._queue) > 1 + first
        ):
            self._queued -= sum(map(len, self._queue[first]))
            del self._queue[first]


def _set_options(sock: socket.socket) -> None:
    """Make a socket send at once, and notice that the other machine has gone."""
    with suppress(OSError):  # a peer that has closed it already
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in _KEEPALIVE:
            if hasattr(socket, name):
                sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


def _name_of(sock: socket.socket) -> tuple[str, str]:
    try:
        host, port = sock.getpeername()[:2]
    except OSError:  # it has closed already
        return "", "a program that has gone"
    return host, f"{host}:{port}"
