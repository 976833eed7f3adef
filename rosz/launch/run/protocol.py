"""The requests of a launch to the machines of its nodes, and their reports.

Those to another machine are JSON, one per line, over the pipes of its agent. The launch sends
`AgentSetup` first, then its other requests. The agent sends `AgentVersion` as soon as it runs.
Anything before that is text that the other machine prints at a login.
"""

from __future__ import annotations

import os
from contextlib import suppress
from typing import Final

import msgspec

from rosz.launch.plan import NodePlan
from rosz.launch.run.excerpt import Excerpt, Position
from rosz.launch.run.process_tree import Usage
from rosz.worker import Worker

PROTOCOL: Final = 2
"""Version of the messages; it changes when an older side would not understand a newer one."""

_CHUNK = 65536
_MAX_LINE = 64 * 1024 * 1024  # a login that prints without line ends must not fill the memory
_CAPACITY = 1024 * 1024
"""Number of waiting bytes at which a writer is full."""


class Timeouts(msgspec.Struct, frozen=True):
    """The time that processes have to end.

    Attributes:
        sigint: Time from SIGINT to SIGTERM in seconds.
        sigterm: Time from SIGTERM to SIGKILL in seconds.
    """

    sigint: float = 15.0
    sigterm: float = 2.0


class ProcessSpec(msgspec.Struct, frozen=True):
    """A process to start.

    Attributes:
        owner: Number of the process in this launch.
        again: Whether it ran before in this launch.
    """

    node: NodePlan
    owner: int
    label: str
    again: bool = False


class AgentSetup(msgspec.Struct, frozen=True, tag="setup"):
    """The settings of the launch that an agent needs.

    Attributes:
        meet: Endpoints where the launch may be found; those without an address, such as
            ``tcp/:7447``, are on the machine from which the agent was started.
        silence: Time in seconds without a message from the launch after which it counts as dead.
    """

    run_id: str
    tag: str
    domain: int
    meet: tuple[str, ...]
    silence: float
    timeouts: Timeouts
    prefixed: bool


class Start(msgspec.Struct, frozen=True, tag="start"):
    """A request to start a process, whose number is never used again."""

    serial: int
    job: ProcessSpec


class Signal(msgspec.Struct, frozen=True, tag="signal"):
    """A request to signal a process and its descendants."""

    serial: int
    number: int


class Ping(msgspec.Struct, frozen=True, tag="ping"):
    """A sign of life."""


class Measure(msgspec.Struct, frozen=True, tag="measure"):
    """A request for the resources that processes use."""


class ReadOutput(msgspec.Struct, frozen=True, tag="read"):
    """A request for the newest output of a process."""

    number: int
    owner: int
    after: Position | None


ProcessRequest = Start | Signal
Request = AgentSetup | ProcessRequest | Ping | Measure | ReadOutput


class AgentVersion(msgspec.Struct, frozen=True, tag="hello"):
    """The report that the agent runs, with the `PROTOCOL` and the version of rosz there."""

    protocol: int
    version: str
    host: str


class Ready(msgspec.Struct, frozen=True, tag="ready"):
    """The report that the agent has handled `AgentSetup`.

    Attributes:
        reaches: Endpoint that its nodes connect to, or "" if they will not find this launch.
    """

    reaches: str


class AgentWarning(msgspec.Struct, frozen=True, tag="notice"):
    """A warning for the user."""

    text: str


class Started(msgspec.Struct, frozen=True, tag="started"):
    """The report that a process runs.

    Attributes:
        pid: Process id on its machine.
        shown: Command line that messages show.
        logs: Pattern of the paths of its logs on its machine, or "" if there are none.
    """

    serial: int
    pid: int
    shown: str
    logs: str


class Refused(msgspec.Struct, frozen=True, tag="refused"):
    """The report that a process could not be started."""

    serial: int
    text: str


class Shown(msgspec.Struct, frozen=True, tag="shown"):
    """Output of nodes for standard output (1) or error (2) of the launch."""

    sink: int
    data: bytes


class Exited(msgspec.Struct, frozen=True, tag="exited"):
    """The report that a process has ended; descendants may still run.

    Attributes:
        code: Exit code, negative for a signal; None if it is not known, because the machine of the
            process is lost.
        tail: The last lines of the output.
    """

    serial: int
    code: int | None
    tail: tuple[str, ...]


class Gone(msgspec.Struct, frozen=True, tag="gone"):
    """The report that a process and all its descendants have ended."""

    serial: int


class Measured(msgspec.Struct, frozen=True, tag="measured"):
    """The resources that processes use, by owner."""

    used: dict[int, Usage]


class OutputRead(msgspec.Struct, frozen=True, tag="output"):
    """The newest output of a process, by the number of the request."""

    number: int
    excerpt: Excerpt


ProcessReport = Started | Refused | Exited | Gone
Report = AgentVersion | Ready | AgentWarning | ProcessReport | Shown | Measured | OutputRead


def rosz_version() -> str:
    """Return the version of rosz on this machine, or "unknown"."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("rosz")
    except PackageNotFoundError:  # run from its sources
        return "unknown"


class MessageWriter(Worker[bytes]):
    """Writes messages to a pipe in order, on a thread, as the pipe may be slow or blocked.

    It closes the pipe at the end.
    """

    def __init__(self, fd: int) -> None:
        super().__init__("rosz messages", self._write, capacity=_CAPACITY, size=len)
        self._fd = fd
        self._broken = False
        self._encoder = msgspec.json.Encoder()

    def send(self, message: msgspec.Struct) -> None:
        """Send a message as soon as possible; it is lost if nobody reads any more."""
        self.submit(self._encoder.encode(message) + b"\n")

    def _write(self, line: bytes) -> None:
        if self._broken:
            return
        try:
            data = memoryview(line)
            while data:
                data = data[os.write(self._fd, data) :]
        except OSError:  # the other side has ended; the end of its own pipe reports that
            self._broken = True
        if self._broken or not line:
            self._broken = True
            with suppress(OSError):
                os.close(self._fd)

    def close(self, timeout: float = 0.0) -> None:
        """Send waiting messages for at most ``timeout`` seconds, and close the pipe.

        A second call only waits.
        """
        self.submit(b"")
        super().close(timeout)


class LineReader:
    """Reads lines from a pipe without blocking.

    Attributes:
        ended: Whether the pipe has ended.
    """

    def __init__(self, fd: int) -> None:
        self.fd = fd
        self.ended = False
        self._rest = b""
        os.set_blocking(fd, False)

    def read(self) -> list[bytes]:
        """Return the lines that have arrived."""
        try:
            data = os.read(self.fd, _CHUNK)
        except BlockingIOError:
            return []
        except OSError:
            data = b""
        if not data:
            self.ended = True
            rest, self._rest = self._rest, b""
            return [rest] if rest else []
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > _MAX_LINE:
            lines, self._rest = [*lines, self._rest], b""
        return lines
