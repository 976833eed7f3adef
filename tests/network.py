"""A network for one test alone, and programs on it, which end with the test."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from textwrap import dedent
from typing import IO, Any, TypeVar

import pytest

from rosz.environment import Environment
from rosz.node import Context, Node
from rosz.session import Session, SessionConfig

__all__ = (
    "TIMEOUT",
    "WHOLE_LINES",
    "WITHOUT_LIMITS",
    "Network",
    "Program",
    "eventually",
    "free_port",
    "repeats",
)

TIMEOUT = 50.0
"""Seconds after which something that should happen at once counts as never happening: a machine
that runs a hundred other programs may take half a minute to start one. After 60 s, sessions give up
silent links and calls their servers, which therefore counts as never, too."""

T = TypeVar("T", bound="Any")
_ROOT = Path(__file__).parent.parent
_RESERVED: list[socket.socket] = []
"""Sockets of the ports that tests of this process were given."""
WHOLE_LINES = (
    "print = lambda *words, end='\\n', flush=False, write=print: "
    "write(' '.join(map(str, words)) + end, end='', flush=flush)\n"
)
"""What keeps the lines of several threads of a program apart."""
WITHOUT_LIMITS = """
    import atexit
    from rosz import lifecycle, worker
    from rosz.node import log_handlers
    from rosz.session import at_exit

    atexit.unregister(at_exit.wait_for_calls)
    atexit.register(at_exit.wait_for_calls, 1e4)
    lifecycle._CLOSE_TIMEOUT = log_handlers._DRAIN_TIMEOUT = 1e4
    worker.Worker.close.__defaults__ = (1e4,)
"""
"""What has a program hang that would end only because its end gives up waiting for something."""


def repeats(usual: int, full: int) -> int:
    """Return how often to try something that may go wrong rarely: ``ROSZ_TEST_FULL=1`` asks for
    the full count."""
    return full if os.environ.get("ROSZ_TEST_FULL", "") not in {"", "0"} else usual


def free_port() -> int:
    """Return a loopback port that nobody listens at, and that the system gives to nobody else.

    A socket stays bound to it, and listens to nothing: connections are refused, and a program that
    names the port may listen, as `SO_REUSEADDR` allows.
    """
    probe = socket.socket()
    probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    probe.bind(("127.0.0.1", 0))
    _RESERVED.append(probe)
    return int(probe.getsockname()[1])


def eventually(
    condition: Callable[[], Any], what: str = "the condition", timeout: float = TIMEOUT
) -> None:
    """Wait until a condition holds that has no event to wait for.

    Args:
        condition: Function that returns whether it holds.
        what: What the condition says, for the failure.
        timeout: Time limit in seconds.
    """
    deadline = time.monotonic() + timeout
    pause = threading.Event()
    while not condition():
        if time.monotonic() > deadline:
            pytest.fail(f"{what}: not within {timeout:g} s")
        pause.wait(0.002)


class Program:
    """A process whose output can be waited for.

    Args:
        command: Command line.
        variables: Environment.
        folder: Working directory; that of the tests when None.
        separate: Whether to keep the lines of stderr apart, in `errors`.

    Attributes:
        lines: Lines that it has written, to either stream or to stdout.
        errors: Lines that it has written to stderr, if these are kept apart.
    """

    def __init__(
        self,
        command: Sequence[str],
        variables: dict[str, str],
        folder: Path | None = None,
        *,
        separate: bool = False,
    ) -> None:
        self.lines: list[str] = []
        self.errors: list[str] = []
        self._changed = threading.Condition()
        self.process = subprocess.Popen(
            command,
            env=variables,
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE if separate else subprocess.STDOUT,
            text=True,
            bufsize=1,
            start_new_session=True,
        )
        self.pid = self.process.pid
        streams = ((self.process.stdout, self.lines), (self.process.stderr, self.errors))
        self._readers = [
            threading.Thread(target=self._read, args=(stream, lines), daemon=True)
            for stream, lines in streams
            if stream is not None
        ]
        self._reading = len(self._readers)
        for reader in self._readers:
            reader.start()

    def _read(self, stream: IO[str], lines: list[str]) -> None:
        for line in stream:
            with self._changed:
                lines.append(line.rstrip("\n"))
                self._changed.notify_all()
        with self._changed:
            self._reading -= 1
            self._changed.notify_all()

    @property
    def output(self) -> str:
        """All that it wrote so far, to either stream."""
        with self._changed:
            return "\n".join(self.lines + self.errors)

    def wait_until(self, condition: Callable[[], object], timeout: float = TIMEOUT) -> bool:
        """Wait until its output fulfils a condition, and return whether it does.

        Args:
            condition: Function that is called after each line.
            timeout: Time limit in seconds; the end of the output ends the wait, too.
        """
        with self._changed:
            self._changed.wait_for(lambda: condition() or not self._reading, timeout)
            return bool(condition())

    def wait_for(
        self,
        text: str | re.Pattern[str],
        timeout: float = TIMEOUT,
        *,
        after: int = 0,
        times: int = 1,
    ) -> str:
        """Wait for a line with a text in it, and return it.

        Args:
            text: Text or regular expression to look for.
            timeout: Time limit in seconds.
            after: Number of lines to leave out at the beginning.
            times: Number of lines with the text to wait for; the last of them is returned.
        """
        pattern = re.compile(re.escape(text)) if isinstance(text, str) else text

        def found() -> list[str]:
            return [line for line in self.lines[after:] + self.errors if pattern.search(line)]

        if not self.wait_until(lambda: len(found()) >= times, timeout):
            missing = text if isinstance(text, str) else text.pattern
            pytest.fail(f"'{missing}' is in {len(found())} lines, not {times}, of:\n{self.output}")
        return found()[times - 1]

    def say(self, line: str) -> None:
        """Write a line to its standard input."""
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")

    def send(self, number: signal.Signals) -> None:
        """Send it a signal."""
        self.process.send_signal(number)

    def kill(self) -> None:
        """End it without its doing."""
        self.process.kill()
        self.process.wait()

    def exit_code(self, timeout: float = TIMEOUT) -> int:
        """Wait for its end, and return its exit code."""
        try:
            code = self.process.wait(timeout)
        except subprocess.TimeoutExpired:
            self.send(signal.SIGABRT)  # faulthandler tells where it stands
            self._join(5)
            pytest.fail(f"the program did not end within {timeout:g} s:\n{self.output}")
        self._join(timeout)
        return code

    def _join(self, timeout: float) -> None:
        for reader in self._readers:
            reader.join(timeout)

    def close(self) -> None:
        """Leave nothing of it behind."""
        if self.process.poll() is None:
            with suppress(ProcessLookupError):  # its group has just ended
                os.killpg(self.pid, signal.SIGKILL)
        self.process.wait()
        self._join(TIMEOUT)
        for stream in (self.process.stdin, self.process.stdout, self.process.stderr):
            if stream is not None:
                stream.close()


class _Joined:
    """A thread as a thing that can be closed."""

    def __init__(self, thread: threading.Thread) -> None:
        self._thread = thread

    def close(self) -> None:
        self._thread.join(TIMEOUT)
        assert not self._thread.is_alive(), "a thread of the test hangs"


class Network:
    """A meeting point and a domain that nobody else has.

    Attributes:
        folder: For files of the test; short enough for unix sockets.
        rendezvous: Where its sessions meet.
        domain: Its ROS domain.
    """

    def __init__(self, domain: int = 42) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="rosz-"))
        self.folder.chmod(0o755)  # not private: sessions listen at loopback ports, as usual
        self.rendezvous = f"unixsock-stream/{self.folder}/z.sock"
        self.domain = domain
        self._open: list[Any] = []

    def environment(self, **changes: Any) -> Environment:
        """Return settings for this network."""
        settings: dict[str, Any] = {
            "domain": self.domain,
            "rendezvous": self.rendezvous,
            "home": self.folder,
            "log_dir": self.folder / "log",
        }
        return Environment(**(settings | changes))

    def context(self, argv: Sequence[str] = (), **changes: Any) -> Context:
        """Return a context with a session of its own."""
        return self._keep(Context(self.environment(**changes), argv))

    def node(self, name: str = "node", *, argv: Sequence[str] = (), **options: Any) -> Node:
        """Return a node on a session of its own, as if in another process."""
        if "context" not in options:
            options["context"] = self.context(argv)
        return self._keep(Node(name, **options))

    def session(self, config: SessionConfig | None = None) -> Session:
        """Return a bare session."""
        return self._keep(Session.open(config or SessionConfig.node(self.environment())))

    def variables(self, **changes: str) -> dict[str, str]:
        """Return environment variables for a program on this network."""
        return {
            "PATH": os.environ.get("PATH", ""),
            "HOME": str(self.folder),
            "PYTHONPATH": str(_ROOT),
            "PYTHONUNBUFFERED": "1",
            "PYTHONFAULTHANDLER": "1",
            "PYTHONWARNINGS": "error",
            "ROS_DOMAIN_ID": str(self.domain),
            "ROSZ_RENDEZVOUS": self.rendezvous,
            "ROSZ_COMPLETION_TIMEOUT": f"{TIMEOUT:g}",
            **changes,
        }

    def program(self, script: str, *argv: str, **variables: str) -> Program:
        """Start a Python program.

        Args:
            script: Its text; indentation common to all lines is taken off.
            argv: Its arguments.
            variables: Environment variables, beside those of the network.
        """
        return self.run("-c", WHOLE_LINES + dedent(script), *argv, **variables)

    def run(self, *argv: str, **variables: str) -> Program:
        """Start Python with a command line."""
        return self._keep(Program([sys.executable, *argv], self.variables(**variables)))

    def execute(self, *command: str, **variables: str) -> Program:
        """Start a program of any kind."""
        return self._keep(Program(command, self.variables(**variables)))

    def thread(self, function: Callable[[], object]) -> threading.Thread:
        """Run a function on a thread that the test waits for in the end."""
        thread = threading.Thread(target=function, daemon=True)
        thread.start()
        self._open.append(_Joined(thread))
        return thread

    def _keep(self, thing: T) -> T:
        self._open.append(thing)
        return thing

    def close(self) -> None:
        """End all that was started here, the newest first."""
        while self._open:
            self._open.pop().close()
        shutil.rmtree(self.folder, ignore_errors=True)
