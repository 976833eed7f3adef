"""A program that copies the output of nodes to the screen, and ends them if their launch is killed.

It is a process of its own (``python -I -S relay.py SOCKET TAG``), so that it outlives a launch
that is killed. It ends when the launch requests it, or when the launch and all nodes have ended.
Lines stay whole: output of two nodes is never mixed within a line. The last lines of each node are
kept for the summary.

Requests arrive on a stream socket, one JSON object per line, together with descriptors::

    {"op": "add", "id": 7, "sink": 1, "prefix": "[talker] "}     with the descriptor to read
    {"op": "child", "id": 7, "pid": 4711}    with a descriptor of the process, which has started
    {"op": "drain", "id": 7}     the reply, once all is read, is {"id": 7, "tail": […]}
    {"op": "read", "id": 7, "after": 0, "number": 3}     the reply, the kept output after
        that many bytes, is {"read": 3, "begin": 0, "data": "…"} in base64
    {"op": "end"}                drain all, then end

The first line that it sends is ``{}``: it has started.
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import re
import resource
import runpy
import select
import selectors
import signal
import socket
import sys
import threading
import time
from collections import deque
from pathlib import Path
from typing import Any

CHUNK = 65536
MAX_LINE = 65536
PARTIAL_SECONDS = 0.2
"""Time in seconds to wait for the rest of a line before its beginning is shown."""
TAIL_LINES = 12
TAIL_COLUMNS = 400
MAX_KEPT = 65536
"""Bytes that are kept of the output of each process."""

_LINE_END = re.compile(rb"[\r\n]")
_ESCAPES = re.compile(r"\x1b(?:\[[0-9;?]*[ -/]*[@-~]|\][^\x07\x1b]*(?:\x07|\x1b\\))|[\x00-\x08\r]")


class Source:
    """A descriptor that nodes write to."""

    def __init__(self, fd: int, owner: int, sink: int, prefix: bytes) -> None:
        self.fd = fd
        self.owner = owner
        self.sink = sink  # 1 or 2
        self.prefix = prefix
        self.partial = b""
        self.since = 0.0

    def add(self, data: bytes) -> bytes:
        """Add data, and return the whole lines that are ready."""
        data = self.partial + data
        end = max(data.rfind(b"\n"), data.rfind(b"\r")) + 1
        if not end and len(data) > MAX_LINE:
            end = len(data)
        self.partial = data[end:]
        self.since = time.monotonic() if self.partial else 0.0
        return data[:end]

    def rest(self) -> bytes:
        """Remove and return the line that has no end yet."""
        data, self.partial, self.since = self.partial, b"", 0.0
        return data

    def add_prefix(self, data: bytes) -> bytes:
        """Return data with the prefix before each line."""
        if not self.prefix or not data:
            return data
        return b"".join(self.prefix + line for line in data.splitlines(keepends=True))


class Newest:
    """The newest output of a process, and the position of its end in all of it, in bytes."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.end = 0

    def add(self, data: bytes) -> None:
        """Add output, and forget the oldest if there is too much."""
        self.end += len(data)
        self.data += data[-MAX_KEPT:]
        if len(self.data) > 2 * MAX_KEPT:
            del self.data[:-MAX_KEPT]

    def after(self, position: int) -> tuple[int, bytes]:
        """Return the kept output after a position, and where it begins.

        Args:
            position: The position; all is returned after one that is not of this output.
        """
        oldest = self.end - min(len(self.data), MAX_KEPT)
        begin = max(oldest, position) if 0 <= position <= self.end else oldest
        return begin, bytes(self.data[len(self.data) - (self.end - begin) :])


class OutputRelay:
    """Copies all sources, and handles requests."""

    def __init__(self, requests: socket.socket, tag: str) -> None:
        self.requests = requests
        self.tag = tag  # of the nodes, which end when the launch is killed
        self.children: dict[int, tuple[int, int]] = {}
        self.selector = selectors.DefaultSelector()
        self.selector.register(requests, selectors.EVENT_READ, None)
        self.sources: dict[int, Source] = {}
        self.tails: dict[int, deque[str]] = {}
        self.newest: dict[int, Newest] = {}
        self.descriptors: deque[int] = deque()
        self.unread = b""
        self.attached = True
        self.broken: set[int] = set()

    def run(self) -> None:
        """Run until the launch requests the end, or the launch and all sources have ended."""
        while self.attached or self.sources:
            for key, _ in self.selector.select(self._timeout()):
                if key.data is None:
                    self._receive()
                elif key.fd in self.sources:
                    self._read(key.data)
            now = time.monotonic()
            for source in self.sources.values():
                if source.since and source.since + PARTIAL_SECONDS <= now:
                    self._show(source, source.rest())

    def _timeout(self) -> float | None:
        waiting = [source.since for source in self.sources.values() if source.since]
        if not waiting:
            return None
        return max(0.0, min(waiting) + PARTIAL_SECONDS - time.monotonic())

    def _receive(self) -> None:
        try:
            data, descriptors, _, _ = socket.recv_fds(self.requests, CHUNK, 64)
        except ConnectionError:
            data, descriptors = b"", []
        self.descriptors.extend(descriptors)
        if not data:
            self._detach()
            # Output is copied meanwhile, or a node that writes as it ends would wait for ever.
            threading.Thread(target=self._end_nodes).start()
        *lines, self.unread = (self.unread + data).split(b"\n")
        for line in lines:
            self._handle(json.loads(line))

    def _detach(self) -> None:
        if self.attached:
            self.attached = False
            self.selector.unregister(self.requests)

    def _end_nodes(self) -> None:
        """End all nodes, because their launch has been killed."""
        # Loaded when it is needed: rosz itself cannot be imported without site-packages.
        end = runpy.run_path(str(Path(__file__).with_name("process_tree.py")))["end_processes"]
        ended, _, _ = select.select([fd for _, fd in self.children.values()], [], [], 0)
        end(self.tag, {pid for pid, fd in self.children.values() if fd not in ended})

    def _handle(self, request: dict[str, Any]) -> None:
        if request["op"] == "add":
            if not self.descriptors:  # no descriptor was free here: the node's output is lost
                return
            fd = self.descriptors.popleft()
            os.set_blocking(fd, False)
            source = Source(fd, request["id"], request["sink"], request["prefix"].encode())
            self.sources[fd] = source
            self.tails.setdefault(source.owner, deque(maxlen=TAIL_LINES))
            self.selector.register(fd, selectors.EVENT_READ, source)
        elif request["op"] == "child":
            self._forget(request["id"])
            if self.descriptors:
                self.children[request["id"]] = (request["pid"], self.descriptors.popleft())
        elif request["op"] == "read":
            self._answer(request)
        elif request["op"] == "drain":
            self._drain(request["id"])
            self._forget(request["id"])
        else:
            for source in list(self.sources.values()):
                self._read_all(source)
                if source.fd in self.sources:
                    self._drop(source)
            self._detach()

    def _forget(self, owner: int) -> None:
        if owner in self.children:
            os.close(self.children.pop(owner)[1])

    def _drain(self, owner: int) -> None:
        for source in [s for s in self.sources.values() if s.owner == owner]:
            self._read_all(source)
            self._show(source, source.rest())
        self._reply({"id": owner, "tail": list(self.tails.get(owner, ()))})

    def _answer(self, request: dict[str, Any]) -> None:
        begin, data = self.newest.get(request["id"], Newest()).after(request["after"])
        text = base64.b64encode(data).decode()
        self._reply({"read": request["number"], "begin": begin, "data": text})

    def _reply(self, reply: dict[str, Any]) -> None:
        with contextlib.suppress(OSError):  # the launch has ended and needs no reply
            self.requests.sendall(json.dumps(reply).encode() + b"\n")

    def _read_all(self, source: Source) -> None:
        while source.fd in self.sources and self._read(source):
            pass

    def _read(self, source: Source) -> bool:
        """Read once, and return whether there may be more to read."""
        try:
            data = os.read(source.fd, CHUNK)
        except BlockingIOError:
            return False
        except OSError:  # a terminal whose other side is closed
            data = b""
        if not data:
            self._drop(source)
            return False
        self._show(source, source.add(data))
        return True

    def _drop(self, source: Source) -> None:
        self._show(source, source.rest())
        self.selector.unregister(source.fd)
        os.close(source.fd)
        del self.sources[source.fd]

    def _show(self, source: Source, data: bytes) -> None:
        if not data:
            return
        self._write(source.sink, source.add_prefix(data))
        self.newest.setdefault(source.owner, Newest()).add(data)
        tail = self.tails[source.owner]
        for line in _LINE_END.split(data[-TAIL_LINES * TAIL_COLUMNS :]):
            text = _ESCAPES.sub("", line.decode(errors="replace")).rstrip()
            if text:
                tail.append(text[:TAIL_COLUMNS])

    def _write(self, sink: int, data: bytes) -> None:
        start = 0
        while start < len(data) and sink not in self.broken:
            # The launch writes to the same pipe. A write of at most PIPE_BUF bytes is not divided.
            most = start + select.PIPE_BUF
            end = data.rfind(b"\n", start, most) + 1 or most
            try:
                start += os.write(sink, data[start:end])
            except BlockingIOError:
                select.select([], [sink], [])
            except OSError:  # the terminal is closed; nodes run on without it
                self.broken.add(sink)


def main() -> None:
    """Handle the requests from the socket whose descriptor is the first argument."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    # It holds two descriptors for each node.
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    requests = socket.socket(fileno=int(sys.argv[1]))
    with contextlib.suppress(OSError):  # the launch has ended already
        requests.sendall(b"{}\n")
    OutputRelay(requests, sys.argv[2]).run()


if __name__ == "__main__":
    main()
