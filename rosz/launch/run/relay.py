"""The program that brings the output of nodes to the screen.

It runs on its own, beside the launch (``python -I -S relay.py``), so that a launch that is killed
leaves its nodes with somewhere to write to. It ends when the launch says so, or when the launch and
all nodes are gone. Lines come out whole: what two nodes say at the same time is never mixed within
a line. Of each node it remembers the last lines, for the summary.

Requests come over a stream socket, one JSON object per line, descriptors along with them::

    {"op": "add", "id": 7, "sink": 1, "prefix": "[talker] "}     with the descriptor to read
    {"op": "drain", "id": 7}     answered, once nothing is left to read, by {"id": 7, "tail": […]}
    {"op": "end"}                drain all, then end
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import resource
import select
import selectors
import signal
import socket
import sys
import time
from collections import deque
from typing import Any

CHUNK = 65536
LONGEST_LINE = 65536
PARTIAL_SECONDS = 0.05
"""How long an unfinished line waits for its end before it is shown as it is."""
TAIL_LINES = 12
TAIL_COLUMNS = 400

_LINE_END = re.compile(rb"[\r\n]")
_ESCAPES = re.compile(r"\x1b(?:\[[0-9;?]*[ -/]*[@-~]|\][^\x07\x1b]*(?:\x07|\x1b\\))|[\x00-\x08\r]")


class Source:
    """One descriptor that nodes write to.

    Args:
        fd: What to read.
        owner: Number of the process it belongs to.
        sink: Descriptor to write to: 1 or 2.
        prefix: What to put before each line.
    """

    def __init__(self, fd: int, owner: int, sink: int, prefix: bytes) -> None:
        self.fd = fd
        self.owner = owner
        self.sink = sink
        self.prefix = prefix
        self.partial = b""
        self.since = 0.0

    def take(self, data: bytes) -> bytes:
        """Add what was read; return the whole lines that are ready."""
        data = self.partial + data
        end = max(data.rfind(b"\n"), data.rfind(b"\r")) + 1
        if not end and len(data) > LONGEST_LINE:
            end = len(data)
        self.partial = data[end:]
        self.since = time.monotonic() if self.partial else 0.0
        return data[:end]

    def rest(self) -> bytes:
        """Return what has no end of line yet, and forget it."""
        data, self.partial, self.since = self.partial, b"", 0.0
        return data

    def dress(self, data: bytes) -> bytes:
        """Put the prefix before each line."""
        if not self.prefix or not data:
            return data
        return b"".join(self.prefix + line for line in data.splitlines(keepends=True))


class Relay:
    """Reads all sources and the requests until told to end.

    Args:
        requests: The socket to the launch.
    """

    def __init__(self, requests: socket.socket) -> None:
        self.requests = requests
        self.selector = selectors.DefaultSelector()
        self.selector.register(requests, selectors.EVENT_READ, None)
        self.sources: dict[int, Source] = {}
        self.tails: dict[int, deque[str]] = {}
        self.descriptors: deque[int] = deque()
        self.unread = b""
        self.attached = True
        self.deaf: set[int] = set()

    def run(self) -> None:
        """Work until the launch ends it, or the launch and all sources are gone."""
        while self.attached or self.sources:
            for key, _ in self.selector.select(self._patience()):
                if key.data is None:
                    self._listen()
                elif key.fd in self.sources:
                    self._read(key.data)
            self._show_partial()

    def _patience(self) -> float | None:
        waiting = [source.since for source in self.sources.values() if source.since]
        if not waiting:
            return None
        return max(0.0, min(waiting) + PARTIAL_SECONDS - time.monotonic())

    def _show_partial(self) -> None:
        now = time.monotonic()
        for source in self.sources.values():
            if source.since and source.since + PARTIAL_SECONDS <= now:
                self._show(source, source.rest())

    def _listen(self) -> None:
        try:
            data, descriptors, _, _ = socket.recv_fds(self.requests, CHUNK, 64)
        except ConnectionError:
            data, descriptors = b"", []
        self.descriptors.extend(descriptors)
        if not data:
            self._detach()
        *lines, self.unread = (self.unread + data).split(b"\n")
        for line in lines:
            self._obey(json.loads(line))

    def _detach(self) -> None:
        if self.attached:
            self.attached = False
            self.selector.unregister(self.requests)

    def _obey(self, request: dict[str, Any]) -> None:
        if request["op"] == "add":
            if not self.descriptors:  # none was left for it here: the node writes to nobody
                return
            fd = self.descriptors.popleft()
            os.set_blocking(fd, False)
            source = Source(fd, request["id"], request["sink"], request["prefix"].encode())
            self.sources[fd] = source
            self.tails.setdefault(source.owner, deque(maxlen=TAIL_LINES))
            self.selector.register(fd, selectors.EVENT_READ, source)
        elif request["op"] == "drain":
            self._drain(request["id"])
        else:
            for source in list(self.sources.values()):
                self._finish(source)
            self._detach()

    def _drain(self, owner: int) -> None:
        for source in [s for s in self.sources.values() if s.owner == owner]:
            while source.fd in self.sources and self._read(source):
                pass
            self._show(source, source.rest())
        tail = list(self.tails.get(owner, ()))
        with contextlib.suppress(OSError):  # the launch is gone: nobody waits for the answer
            self.requests.sendall(json.dumps({"id": owner, "tail": tail}).encode() + b"\n")

    def _finish(self, source: Source) -> None:
        while source.fd in self.sources and self._read(source):
            pass
        if source.fd in self.sources:
            self._drop(source)

    def _read(self, source: Source) -> bool:
        """Read what is there; tell whether there may be more."""
        try:
            data = os.read(source.fd, CHUNK)
        except BlockingIOError:
            return False
        except OSError:  # a terminal whose other side is closed
            data = b""
        if not data:
            self._drop(source)
            return False
        self._show(source, source.take(data))
        return True

    def _drop(self, source: Source) -> None:
        self._show(source, source.rest())
        self.selector.unregister(source.fd)
        os.close(source.fd)
        del self.sources[source.fd]

    def _show(self, source: Source, data: bytes) -> None:
        if not data:
            return
        self._write(source.sink, source.dress(data))
        tail = self.tails[source.owner]
        for line in _LINE_END.split(data[-TAIL_LINES * TAIL_COLUMNS :]):
            text = _ESCAPES.sub("", line.decode(errors="replace")).rstrip()
            if text:
                tail.append(text[:TAIL_COLUMNS])

    def _write(self, sink: int, data: bytes) -> None:
        view = memoryview(data)
        while view and sink not in self.deaf:
            try:
                view = view[os.write(sink, view) :]
            except BlockingIOError:
                select.select([], [sink], [])
            except OSError:  # the terminal is closed; the nodes go on without it
                self.deaf.add(sink)


def main() -> None:
    """Serve the socket whose descriptor is the first argument."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    # It holds two descriptors for each node, the launch one.
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    Relay(socket.socket(fileno=int(sys.argv[1]))).run()


if __name__ == "__main__":
    main()
