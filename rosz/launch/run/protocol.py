"""What a launch and its agent on another machine say to each other: JSON, one message per line.

The launch says `Setup` first, then whatever is to be done; the agent says `Hello` first, as soon as
it runs. What comes before `Hello` is what the other machine prints at a login, and no message.
"""

from __future__ import annotations

from typing import Final

import msgspec

from rosz.launch.run.family import Usage
from rosz.launch.run.host import Job
from rosz.launch.run.process import Timeouts

__all__ = (
    "PROTOCOL",
    "Exited",
    "Gone",
    "Hello",
    "Measure",
    "Measured",
    "Notice",
    "Ping",
    "Ready",
    "Refused",
    "Report",
    "Request",
    "Setup",
    "Shown",
    "Signal",
    "Start",
    "Started",
    "rosz_version",
)

PROTOCOL: Final = 1
"""Changes whenever an older side would not understand a newer one."""


class Setup(msgspec.Struct, frozen=True, tag="setup"):
    """What an agent has to know of the launch.

    Attributes:
        run_id: Id of the run, which names the folder for logs.
        tag: Marks everything that the agent starts.
        domain: The ROS domain.
        meet: Endpoints where the launch may be found; those that end in ``:PORT`` alone, such as
            ``tcp/:7447``, are on the machine that the agent was called from.
        silence: Seconds without a word from the launch after which it counts as dead.
        timeouts: How long processes may take to end.
        prefixed: Whether lines begin with the name of their node.
    """

    run_id: str
    tag: str
    domain: int
    meet: tuple[str, ...]
    silence: float
    timeouts: Timeouts
    prefixed: bool


class Start(msgspec.Struct, frozen=True, tag="start"):
    """Start a process; `serial` names it from now on, and never another one."""

    serial: int
    job: Job


class Signal(msgspec.Struct, frozen=True, tag="signal"):
    """Signal a process and its descendants."""

    serial: int
    number: int


class Ping(msgspec.Struct, frozen=True, tag="ping"):
    """A sign of life."""


class Measure(msgspec.Struct, frozen=True, tag="measure"):
    """Say what the processes have used."""


Request = Setup | Start | Signal | Ping | Measure


class Hello(msgspec.Struct, frozen=True, tag="hello"):
    """The agent runs.

    Attributes:
        protocol: Its `PROTOCOL`.
        version: Version of rosz there.
        host: Name of the machine by itself.
    """

    protocol: int
    version: str
    host: str


class Ready(msgspec.Struct, frozen=True, tag="ready"):
    """The agent has understood `Setup`.

    Attributes:
        reaches: Where its nodes link to; empty where they will not find this launch.
    """

    reaches: str


class Notice(msgspec.Struct, frozen=True, tag="notice"):
    """Something that somebody should know."""

    text: str


class Started(msgspec.Struct, frozen=True, tag="started"):
    """A process runs.

    Attributes:
        serial: Which one.
        pid: Its id there.
        shown: Its command line as messages show it.
        logs: What matches its logs there; empty where none are kept.
    """

    serial: int
    pid: int
    shown: str
    logs: str


class Refused(msgspec.Struct, frozen=True, tag="refused"):
    """A process could not be started."""

    serial: int
    text: str


class Shown(msgspec.Struct, frozen=True, tag="shown"):
    """Something for the screen: whole lines for standard output (1) or error (2)."""

    sink: int
    data: bytes


class Exited(msgspec.Struct, frozen=True, tag="exited"):
    """A process has ended; descendants of it may be left."""

    serial: int
    code: int
    tail: tuple[str, ...]


class Gone(msgspec.Struct, frozen=True, tag="gone"):
    """Nothing of a process is left."""

    serial: int


class Measured(msgspec.Struct, frozen=True, tag="measured"):
    """What processes have used, by their owners' numbers."""

    used: dict[int, Usage]


Report = Hello | Ready | Notice | Started | Refused | Shown | Exited | Gone | Measured


def rosz_version() -> str:
    """Return the version of rosz on this machine, as far as it is known."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("rosz")
    except PackageNotFoundError:  # run from its sources
        return "unknown"
