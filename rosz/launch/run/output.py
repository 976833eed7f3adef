"""Where nodes write to: the screen, by way of the relay, or a file of the run's folder.

A node that writes to a terminal is given one of its own, so that it keeps its colours and its
line-wise output; one whose launch writes to a file or pipe is given a pipe.
"""

from __future__ import annotations

import contextlib
import fcntl
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

from rosz.launch.run.loop import Loop, Timer

__all__ = ("Output", "Streams")

_DRAIN_SECONDS = 0.5
"""How long the relay may take to show the last lines before a death is reported without them."""
_END_SECONDS = 5.0
"""How long a screen that takes nothing, such as a stopped terminal, holds up the end."""
_LEAST_LIFE_SECONDS = 1.0
"""A relay that dies sooner would die again."""
_ASK_SECONDS = 0.5
"""How long the relay may take to hear a request, unless it is known to hear none."""

Told = Callable[[tuple[str, ...]], None]


class Streams(msgspec.Struct, frozen=True):
    """Descriptors for a process about to start; close them once it has.

    Attributes:
        stdin: To read from; None where it may read what the launch reads.
        stdout: To write to; None where it writes right where the launch does.
        stderr: As stdout.
        terminal: Whether what the process writes to is a terminal.
    """

    stdin: int | None
    stdout: int | None
    stderr: int | None
    terminal: bool

    def close(self) -> None:
        """Close this side of the descriptors."""
        for fd in (self.stdin, self.stdout, self.stderr):
            if fd is not None:
                os.close(fd)


class Output:
    """The relay process, and what is asked of it.

    Args:
        loop: Where its answers are awaited.
        warn: Told when it has died.
    """

    def __init__(self, loop: Loop, warn: Callable[[str], None]) -> None:
        self._loop = loop
        self._warn = warn
        self._waiting: dict[int, tuple[Told, Timer]] = {}
        self._unread = b""
        self._terminals = (os.isatty(1), os.isatty(2))
        self._same = _same_file(1, 2)
        self._begin()

    def _begin(self) -> None:
        self._began = self._loop.now()
        self._requests, theirs = socket.socketpair()
        self._requests.settimeout(_ASK_SECONDS)
        script = Path(__file__).with_name("relay.py")
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-S", str(script), str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                start_new_session=True,
                cwd="/",
            )
        self._loop.watch(self._requests.fileno(), self._answered)

    def screen(self, owner: int, prefix: str) -> Streams:
        """Return streams that end up on the screen.

        Args:
            owner: Number of the process, for `drain`.
            prefix: What to put before each line.
        """
        if all(self._terminals) and self._same:
            terminal = self._terminal(owner, 1, prefix)
            if terminal is not None:
                return Streams(_input(), terminal, os.dup(terminal), terminal=True)
        out = self._pipe(owner, 1, prefix)
        err = os.dup(out) if self._same else self._pipe(owner, 2, prefix)
        return Streams(_input(), out, err, terminal=False)

    def log(self, owner: int, prefix: str, file: Path | None, mode: Literal["w", "a"]) -> Streams:
        """Return streams whose standard output ends up in a file, and only errors on the screen.

        Args:
            owner: Number of the process, for `drain`.
            prefix: What to put before each line on the screen.
            file: Where to; None discards it.
            mode: ``w`` to begin the file anew, ``a`` to go on with it.

        Raises:
            OSError: The file cannot be written.
        """
        how = os.O_WRONLY | os.O_CREAT | (os.O_TRUNC if mode == "w" else os.O_APPEND)
        out = os.open(file or os.devnull, how, 0o644)
        err = self._terminal(owner, 2, prefix) if self._terminals[1] else None
        if err is None:
            err = self._pipe(owner, 2, prefix)
        return Streams(_input(), out, err, terminal=False)

    @staticmethod
    def direct() -> Streams:
        """Return the streams of the launch itself, as a debugger in the same terminal needs."""
        return Streams(None, None, None, terminal=os.isatty(1))

    def _terminal(self, owner: int, sink: int, prefix: str) -> int | None:
        try:
            ours, theirs = os.openpty()
        except OSError:  # none left, or none in this container: a pipe does, without colours
            return None
        _pass_through(theirs)
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
        heard = self._ask({"op": "add", "id": owner, "sink": sink, "prefix": prefix}, fd)
        os.close(fd)
        return heard

    def _ask(self, request: dict[str, Any], *fds: int) -> bool:
        """Tell whether the relay takes requests; without it the screen is lost, not the run."""
        try:
            socket.send_fds(self._requests, [json.dumps(request).encode() + b"\n"], fds)
        except OSError:  # it was killed, or waits for a screen that has long taken nothing
            self._requests.settimeout(0)
            return False
        self._requests.settimeout(_ASK_SECONDS)
        return True

    def drain(self, owner: int, told: Told) -> None:
        """Have all that a process wrote shown, then be told its last lines.

        Args:
            owner: Number of the process.
            told: Called on the loop, after half a second at the latest.
        """
        timer = self._loop.later(_DRAIN_SECONDS, lambda: self._tell(owner, ()))
        self._waiting[owner] = (told, timer)
        self._ask({"op": "drain", "id": owner})

    def _tell(self, owner: int, tail: tuple[str, ...]) -> None:
        told, timer = self._waiting.pop(owner, (None, None))
        if told is not None and timer is not None:
            timer.cancel()
            told(tail)

    def _answered(self) -> None:
        try:
            data = self._requests.recv(65536)
        except ConnectionError:
            data = b""
        if not data:
            self._lost()
        *lines, self._unread = (self._unread + data).split(b"\n")
        for line in lines:
            answer = json.loads(line)
            self._tell(answer["id"], tuple(answer["tail"]))

    def _lost(self) -> None:
        """Begin anew after the death of the relay, unless it has only just begun."""
        self._loop.unwatch(self._requests.fileno())
        code = self._process.wait()
        self._unread = b""
        told = f"what shows the output of nodes (pid {self._process.pid}) has died ({code}): nodes"
        if self._loop.now() - self._began < _LEAST_LIFE_SECONDS:
            self._warn(f"{told} write to nobody from now on")
            return
        self._warn(
            f"{told} that run now write to nobody, and may end of it; those that start from now on"
            " are shown again ('rosz launch --restart NODE')"
        )
        self._requests.close()
        self._begin()

    def close(self) -> None:
        """Have everything shown, and end the relay; again is no error."""
        if self._requests.fileno() < 0:
            return
        self._loop.unwatch(self._requests.fileno())
        self._ask({"op": "end"})
        self._requests.close()
        try:
            self._process.wait(_END_SECONDS)
        except subprocess.TimeoutExpired:  # its screen takes nothing any more
            self._process.kill()
            self._process.wait()


def _input() -> int | None:
    """Return what nodes read: the terminal of the launch, as in ROS 1, or nothing.

    A pipe is none of theirs: over ssh it carries what the launch tells the agent.
    """
    return None if os.isatty(0) else os.open(os.devnull, os.O_RDONLY)


def _same_file(first: int, second: int) -> bool:
    try:
        return os.path.sameopenfile(first, second)
    except OSError:
        return False


def _pass_through(terminal: int) -> None:
    """Have a terminal pass bytes on as they are: no echo, no translation of line ends."""
    settings = termios.tcgetattr(terminal)
    settings[0] = settings[1] = settings[3] = 0
    termios.tcsetattr(terminal, termios.TCSANOW, settings)
