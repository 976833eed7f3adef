"""The output of nodes: to the screen through the relay process, or to a file of the run's folder.

A node whose launch writes to a terminal gets a terminal of its own, so that it keeps its colours
and writes line by line; otherwise it gets a pipe.
"""

from __future__ import annotations

import base64
import contextlib
import fcntl
import itertools
import json
import os
import socket
import subprocess
import sys
import termios
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import msgspec

from rosz.errors import LaunchError
from rosz.launch.run.loop import Loop, LoopTimer
from rosz.launch.run.process_tree import TAG

_DRAIN_TIMEOUT = 0.5
"""Time in seconds to wait for the last lines of a process before its end is reported."""
_RELAY_TIMEOUT = 5.0
"""Time in seconds for the relay to start, and to end when its screen accepts nothing."""
_MIN_LIFE = 1.0
"""Time in seconds: a relay that ends sooner is not started again."""
_READ_TIMEOUT = 4.0
"""Time in seconds to wait for output that is kept, before there counts as none."""
_SEND_TIMEOUT = 0.5
"""Time in seconds for the relay to receive a request, unless the last one failed."""


class RunFolder:
    """The log folder of one run, ``<log folder>/<run id>``, and the link ``latest`` to it."""

    def __init__(self, log_dir: Path, run_id: str) -> None:
        self.path = log_dir / run_id

    def create(self) -> None:
        """Create the folder, and let ``latest`` point to it.

        Raises:
            LaunchError: If it cannot be created or written to.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._point_latest()
        except OSError as error:
            raise LaunchError(
                f"cannot keep logs in '{self.path}': {error.strerror}; set ROS_LOG_DIR to a folder"
                " that can be written to"
            ) from error

    def _point_latest(self) -> None:
        latest = self.path.parent / "latest"
        if latest.exists() and not latest.is_symlink():
            return  # a real folder of the user
        fresh = latest.with_name(f".latest-{os.getpid()}")
        fresh.unlink(missing_ok=True)
        fresh.symlink_to(self.path.name)
        fresh.replace(latest)

    def node_log(self, label: str) -> Path:
        """Return the path of the log that a process writes itself."""
        return self.path / f"{_file_name(label)}.log"

    def stdout_log(self, label: str) -> Path:
        """Return the path for the standard output of a process that is not shown."""
        return self.path / f"{_file_name(label)}-stdout.log"

    def pattern(self, label: str) -> str:
        """Return the pattern of all logs of a process, as messages show it."""
        return str(self.path / f"{_file_name(label)}*.log")


def _file_name(label: str) -> str:
    return label.replace("/", "-")


class Streams(msgspec.Struct, frozen=True):
    """The descriptors for a process about to start, to be closed once it has started.

    None stands for the descriptor of the launch.
    """

    stdin: int | None
    stdout: int | None
    stderr: int | None
    terminal: bool

    def close(self) -> None:
        """Close the descriptors in this process."""
        for fd in (self.stdin, self.stdout, self.stderr):
            if fd is not None:
                os.close(fd)


class RelayedOutput:
    """The launch's side of the relay process."""

    def __init__(self, loop: Loop, warn: Callable[[str], None], tag: str) -> None:
        self._loop = loop
        self._warn = warn
        self._tag = tag
        self._waiting: dict[tuple[str, int], tuple[Callable[[Any], None], LoopTimer]] = {}
        self._numbers = itertools.count()
        self._unread = b""
        self._terminals = (os.isatty(1), os.isatty(2))
        self._same = _same_file(1, 2)
        self._start()

    def _start(self) -> None:
        self._began = self._loop.now()
        self._ready = False
        self._requests, theirs = socket.socketpair()
        self._requests.settimeout(_SEND_TIMEOUT)
        script = Path(__file__).with_name("relay.py")
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-S", str(script), str(theirs.fileno()), self._tag],
                stdin=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                start_new_session=True,
                cwd="/",
                # An outer launch that kills this one must not kill the relay, which ends the rest.
                env={name: value for name, value in os.environ.items() if name != TAG},
            )
        self._loop.watch(self._requests.fileno(), self._receive)

    def screen(self, owner: int, prefix: str) -> Streams:
        """Return streams for a process whose output is shown on the screen."""
        if all(self._terminals) and self._same:
            terminal = self._terminal(owner, 1, prefix)
            if terminal is not None:
                return Streams(_input(), terminal, os.dup(terminal), terminal=True)
        out = self._pipe(owner, 1, prefix)
        err = os.dup(out) if self._same else self._pipe(owner, 2, prefix)
        return Streams(_input(), out, err, terminal=False)

    def log(self, owner: int, prefix: str, file: Path | None, mode: Literal["w", "a"]) -> Streams:
        """Return streams for a process whose standard output goes to a file, and errors are shown.

        Without a file the output is discarded.

        Raises:
            OSError: If the file cannot be written.
        """
        how = os.O_WRONLY | os.O_CREAT | (os.O_TRUNC if mode == "w" else os.O_APPEND)
        out = os.open(file or os.devnull, how, 0o644)
        err = self._terminal(owner, 2, prefix) if self._terminals[1] else None
        if err is None:
            err = self._pipe(owner, 2, prefix)
        return Streams(_input(), out, err, terminal=False)

    def _terminal(self, owner: int, sink: int, prefix: str) -> int | None:
        try:
            ours, theirs = os.openpty()
        except OSError:  # no terminal available: a pipe works, without colours
            return None
        # It passes bytes unchanged: no echo, no translation of line ends.
        settings = termios.tcgetattr(theirs)
        settings[0] = settings[1] = settings[3] = 0
        termios.tcsetattr(theirs, termios.TCSANOW, settings)
        with contextlib.suppress(OSError):
            size = fcntl.ioctl(sink, termios.TIOCGWINSZ, b"\0" * 8)
            fcntl.ioctl(theirs, termios.TIOCSWINSZ, size)
        if self._add(owner, sink, prefix, ours):
            return theirs
        os.close(theirs)
        return None

    def _pipe(self, owner: int, sink: int, prefix: str) -> int:
        ours, theirs = os.pipe()
        if self._add(owner, sink, prefix, ours):
            return theirs
        os.close(theirs)
        return os.open(os.devnull, os.O_WRONLY)

    def _add(self, owner: int, sink: int, prefix: str, fd: int) -> bool:
        sent = self._send({"op": "add", "id": owner, "sink": sink, "prefix": prefix}, fd)
        os.close(fd)
        return sent

    def _send(self, request: dict[str, Any], *fds: int) -> bool:
        """Send a request, and return whether the relay received it; nodes run on without it."""
        try:
            socket.send_fds(self._requests, [json.dumps(request).encode() + b"\n"], fds)
        except OSError:  # it was killed, or is blocked by a screen that accepts nothing
            self._requests.settimeout(0)
            return False
        self._requests.settimeout(_SEND_TIMEOUT)
        return True

    def started(self, owner: int, pid: int) -> None:
        """Report the process that uses the streams of an owner, which the relay may have to end."""
        try:
            process = os.pidfd_open(pid)
        except (AttributeError, OSError):  # an older kernel: only tags are known
            return
        self._send({"op": "child", "id": owner, "pid": pid}, process)
        os.close(process)

    def drain(self, owner: int, done: Callable[[tuple[str, ...]], None]) -> None:
        """Show all that a process wrote, then call a function with its last lines.

        Args:
            owner: Number of the process.
            done: Called on the loop, after half a second at the latest once the relay has started.
        """
        timeout = _DRAIN_TIMEOUT if self._ready else _RELAY_TIMEOUT
        self._request({"op": "drain", "id": owner}, timeout, ("id", owner), done, ())

    def read(self, owner: int, after: int, done: Callable[[tuple[int, bytes]], None]) -> None:
        """Call a function on the loop with the newest output of a process: its begin, and the data.

        The relay keeps a part of the output; bytes up to ``after`` are left out.
        """
        number = next(self._numbers)
        request = {"op": "read", "id": owner, "after": after, "number": number}
        self._request(request, _READ_TIMEOUT, ("read", number), done, (after, b""))

    def _request(
        self,
        request: dict[str, Any],
        timeout: float,
        key: tuple[str, int],
        done: Callable[[Any], None],
        missing: Any,
    ) -> None:
        """Send a request, and call a function with its reply, or after a time with a substitute."""
        timer = self._loop.later(timeout, lambda: self._answer(key, missing))
        self._waiting[key] = done, timer
        self._send(request)

    def _answer(self, key: tuple[str, int], reply: Any) -> None:
        if key in self._waiting:
            done, timer = self._waiting.pop(key)
            timer.cancel()
            done(reply)

    def _receive(self) -> None:
        try:
            data = self._requests.recv(65536)
        except ConnectionError:
            data = b""
        if not data:
            self._restart()
        *lines, self._unread = (self._unread + data).split(b"\n")
        for line in lines:
            self._ready = True
            reply = json.loads(line)
            if "read" in reply:
                data = base64.b64decode(reply["data"])
                self._answer(("read", reply["read"]), (reply["begin"], data))
            elif reply:
                self._answer(("id", reply["id"]), tuple(reply["tail"]))

    def _restart(self) -> None:
        """Start the relay again after its death, unless it died right after its start."""
        self._loop.unwatch(self._requests.fileno())
        code = self._process.wait()
        self._unread = b""
        text = f"the relay of the nodes' output (pid {self._process.pid}) has died ({code}): nodes"
        if self._loop.now() - self._began < _MIN_LIFE:
            self._warn(f"{text} started from now on have no output")
            return
        self._warn(
            f"{text} that run now have lost their output, and may end because of it; nodes that"
            " start from now on are shown again ('rosz launch --restart NODE')"
        )
        self._requests.close()
        self._start()

    def close(self) -> None:
        """Show everything, and end the relay; a second call has no effect."""
        if self._requests.fileno() < 0:
            return
        self._loop.unwatch(self._requests.fileno())
        self._send({"op": "end"})
        self._requests.close()
        try:
            self._process.wait(_RELAY_TIMEOUT)
        except subprocess.TimeoutExpired:  # its screen accepts nothing
            self._process.kill()
            self._process.wait()


def _input() -> int | None:
    """Return the standard input of nodes: None for the launch's terminal, as in ROS 1, or nothing.

    Nodes do not get a pipe: over ssh it carries the requests of the launch.
    """
    return None if os.isatty(0) else os.open(os.devnull, os.O_RDONLY)


def _same_file(first: int, second: int) -> bool:
    try:
        return os.path.sameopenfile(first, second)
    except OSError:
        return False
