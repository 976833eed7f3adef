"""The port of a bridge: XML-RPC and TCPROS on one, told apart by their first bytes.

A call begins with ``POST``: read as the length of a connection header, that exceeds the limit.
"""

from __future__ import annotations

import errno
import selectors
import socket
import threading
from collections.abc import Callable
from functools import partial
from typing import Any
from weakref import WeakMethod

from rosz.bridges.ros1.calls import CallReader, RpcCall, encode_fault, encode_refusal, encode_result
from rosz.bridges.ros1.frames import FrameReader, decode_header
from rosz.bridges.ros1.sockets import Handler, SocketLoop, Stream, log
from rosz.errors import DecodeError, RoszError, TransportError
from rosz.worker import Worker

Dispatch = Callable[[RpcCall, Stream], Any]
"""Function that returns the result of a call."""

_POST = b"POST"
_TAKEN = (
    "another program listens there: if it is a roscore, `rosz bridge ros1 --master"
    " http://localhost:{port}` joins it; --port takes another port"
)
_THREADS = 16
_MAX_CALLS = 2000
_BACKLOG = 512
_ACCEPTED_AT_ONCE = 64
_TIMEOUT = 30.0
_PAUSE = 1.0
_MAX_REPORTED = 1000
_PIECE = 1 << 16
_MAX_HELD = 256 << 20
"""Largest number of bytes of unanswered calls and headers, of all connections together."""


class Ros1Server:
    """Listens for calls and connections of ROS 1's programs, once it is started.

    Attributes:
        port: Port that it listens at.

    Raises:
        TransportError: It cannot listen there.
    """

    def __init__(self, loop: SocketLoop, host: str, port: int) -> None:
        self.loop = loop
        # One buffer for all connections: what is read is handled before the next read.
        self.piece = bytearray(_PIECE)
        self.dispatch: Dispatch
        self.connect: Callable[[Incoming, dict[str, str]], object]
        self.calls: Worker[Callable[[], object]] = Worker(
            "rosz-ros1-calls", threads=_THREADS, capacity=_MAX_CALLS, logger=log
        )
        self._held = 0
        self._holding = threading.Lock()
        self._streams: set[Stream] = set()
        self._reported: set[str] = set()
        try:
            self._socket = socket.create_server((host, port), backlog=_BACKLOG)
        except (OSError, OverflowError) as error:
            taken = getattr(error, "errno", 0) == errno.EADDRINUSE
            reason = _TAKEN.format(port=port) if taken else str(error)
            raise TransportError(f"cannot listen at {host}:{port}: {reason}") from error
        self._socket.setblocking(False)
        self.port: int = self._socket.getsockname()[1]

    def start(
        self, dispatch: Dispatch, connect: Callable[[Incoming, dict[str, str]], object]
    ) -> None:
        """Accept connections from now on.

        Args:
            dispatch: Function that returns the result of a call, on a thread of the server; a
                `RoszError` becomes a fault.
            connect: Function called with a connection and its header, on the thread of the loop.
        """
        self.dispatch, self.connect = dispatch, connect
        self.loop.call(lambda: self._watch_socket(selectors.EVENT_READ))

    def close(self) -> None:
        """Close the port and all connections; a second call has no effect."""
        self.calls.close()
        self.loop.call(self._close)

    def report(self, text: str) -> None:
        """Log a warning once, since refused programs try again."""
        if text not in self._reported and len(self._reported) < _MAX_REPORTED:
            self._reported.add(text)
            log.warning("%.500s (told once)", text)

    def hold(self, count: int) -> None:
        """Add to the number of bytes of unanswered requests; a negative count subtracts.

        Raises:
            TransportError: The number would be too large; it is unchanged.
        """
        with self._holding:
            if count > 0 and self._held + count > _MAX_HELD:
                raise TransportError(
                    f"the requests of all connections take more than {_MAX_HELD >> 20} MB"
                )
            self._held += count

    def forget(self, stream: Stream) -> None:
        """Remove a stream that has ended."""
        self._streams.discard(stream)

    def _close(self) -> None:
        if self._socket.fileno() >= 0:
            self.loop.watch(self._socket, 0, self._accept)
            self._socket.close()
        for stream in list(self._streams):
            stream.close()

    def _watch_socket(self, events: int) -> None:
        if self._socket.fileno() >= 0:
            self.loop.watch(self._socket, events, self._accept)

    def _accept(self, _events: int) -> None:
        for _ in range(_ACCEPTED_AT_ONCE):
            try:
                sock, _ = self._socket.accept()
            except BlockingIOError:
                return
            except OSError as error:
                if self._socket.fileno() >= 0 and error.errno in {errno.EMFILE, errno.ENFILE}:
                    log.warning("cannot take a connection: %s; trying again", error.strerror)
                    self._watch_socket(0)
                    self.loop.later(_PAUSE, lambda: self._watch_socket(selectors.EVENT_READ))
                return
            incoming = Incoming(self, sock)
            self._streams.add(incoming.stream)


class Incoming(Handler):
    """A connection from another program, which sends either calls or one header."""

    def __init__(self, server: Ros1Server, sock: socket.socket) -> None:
        self.server = server
        self._held = 0
        self._first = b""
        self._calls: CallReader | None = None
        self._frames: FrameReader | None = None
        self._has_header = False
        self.stream = Stream(server.loop, sock, self, self._ended)
        self._check_later()

    def space(self) -> memoryview:
        """Return the buffer for the next bytes."""
        return memoryview(self.server.piece)

    def received(self, count: int) -> None:
        """Read calls, or the header."""
        data = memoryview(self.server.piece)[:count]
        if self._calls is None and self._frames is None:
            self._first += data
            if len(self._first) < len(_POST):
                return
            if self._first.startswith(_POST):
                self._calls = CallReader()
            else:
                self._frames = FrameReader()
            data = memoryview(self._first)
            self._first = b""
        if self._calls is not None:
            self._feed_calls(self._calls, data)
        elif self._frames is not None:
            self._feed_header(self._frames, data)

    def hold(self, count: int) -> None:
        """Set the number of bytes of an incomplete request that the connection holds.

        Raises:
            TransportError: All connections together hold too many.
        """
        before, self._held = self._held, 0
        self.server.hold(-before)
        self.server.hold(count)
        self._held = count

    def _ended(self, stream: Stream) -> None:
        self.server.forget(stream)
        self.hold(0)

    def refuse(self, text: str) -> None:
        """Log an error once, and close the stream; any thread may call this."""
        self.server.report(f"refused a connection of {self.stream.host}: {text}")
        self.stream.end()

    def _feed_calls(self, reader: CallReader, data: memoryview) -> None:
        try:
            for call in reader.feed(data):
                self.hold(0)
                self.server.hold(call.size)
                if not self.server.calls.offer(partial(self._answer, call)):
                    self.server.hold(-call.size)
                    self.stream.send([encode_fault("the master is busy: try again")])
            self.hold(reader.size)
        except DecodeError as error:
            self.stream.send([encode_refusal(str(error))])
            raise

    def _answer(self, call: RpcCall) -> None:
        try:
            data = encode_result(
                self.server.dispatch(call, self.stream), keep_alive=call.keep_alive
            )
        except RoszError as error:
            data = encode_fault(str(error), keep_alive=call.keep_alive)
        finally:
            self.server.hold(-call.size)
        self.stream.send([data])
        if not call.keep_alive:
            self.stream.end()

    def _feed_header(self, reader: FrameReader, data: memoryview) -> None:
        while data and not self._has_header:
            space = reader.space()
            count = min(len(space), len(data))
            space[:count] = data[:count]
            data = data[count:]
            for frame in reader.take(count):
                self._has_header = True
                header = decode_header(frame)
                # The other end sends nothing until it is answered.
                self.stream.pause(reading=False)
                self.hold(0)
                self.server.connect(self, header)
                return
            self.hold(reader.pending)

    def _check_later(self) -> None:
        """Check the progress after a while; the timer does not keep an ended connection alive."""
        check = WeakMethod(self._check_progress)

        def run() -> None:
            method = check()
            if method is not None:
                method()

        self.server.loop.later(_TIMEOUT, run)

    def _check_progress(self) -> None:
        """Close a connection whose call or header is still incomplete."""
        if self.stream.is_closed or self._has_header:
            return
        if self._calls is not None and self._calls.is_idle:
            self._check_later()
            return
        log.warning(
            "closed the connection of %s: nothing complete in %g s", self.stream.peer, _TIMEOUT
        )
        self.stream.close()
