"""Machines that processes run on: this one is `LocalHost`, others are of `remote`."""

from __future__ import annotations

import errno
import getpass
import os
import socket
import subprocess
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Protocol

import msgspec

from rosz.errors import LaunchError, RoszError
from rosz.launch.plan.model import MachinePlan, NodePlan
from rosz.launch.run.command import TAG, Command, Workplace
from rosz.launch.run.family import Census, Usage, group_lives, usage
from rosz.launch.run.folder import RunFolder
from rosz.launch.run.loop import Loop
from rosz.launch.run.output import Output, Streams

__all__ = ("Child", "Confirmed", "Ended", "Host", "Job", "LocalHost", "is_local")

Ended = Callable[[int, tuple[str, ...]], None]
"""Gets the exit code, negative for a signal, and the last lines of the output."""

Confirmed = Callable[[RoszError | None], None]
"""Gets why a process could not be started, or None once it has."""

_HERE = frozenset({"", "localhost", "127.0.0.1", "::1"})


class Job(msgspec.Struct, frozen=True):
    """A process to start.

    Attributes:
        node: What.
        owner: Its number in this launch.
        label: What messages call it.
        again: Whether it ran before in this launch.
    """

    node: NodePlan
    owner: int
    label: str
    again: bool = False


class Child(Protocol):
    """A process that was started, with all that it starts itself."""

    @property
    def pid(self) -> int:
        """Process id on its machine."""

    @property
    def shown(self) -> str:
        """Command line as messages show it."""

    @property
    def logs(self) -> str:
        """What matches its logs on its machine; empty where none are kept."""

    @property
    def place(self) -> str:
        """Address of its machine; empty for this one."""

    @property
    def pending(self) -> bool:
        """Whether its machine has not said yet that it runs."""

    def signal(self, number: int) -> None:
        """Signal it and its descendants; those that are gone are no error."""

    def remains(self) -> bool:
        """Tell whether it or a descendant is still there."""


class Host(Protocol):
    """A machine that processes can be started on."""

    @property
    def place(self) -> str:
        """Its address; empty for this machine."""

    def start(self, job: Job, ended: Ended, confirmed: Confirmed) -> Child:
        """Start a process.

        Args:
            job: What.
            ended: Called on the loop when the process itself has ended.
            confirmed: Called on the loop where the child was pending, when it is not any more.

        Raises:
            PackageNotFound: The machine has no such package.
            ExecutableNotFound: The package has no such executable.
            LaunchError: The system refuses to start it.
        """

    def measure(self, done: Callable[[dict[int, Usage]], None]) -> None:
        """Have what its processes have used counted, by their owners' numbers."""


class LocalChild:
    """A process of this machine, in a session and process group of its own.

    Args:
        process: The process.
        command: How it was started.
        census: Where its descendants are found that left the group.
        logs: What matches its logs.
    """

    place = ""
    pending = False

    def __init__(
        self, process: subprocess.Popen[bytes], command: Command, census: Census, logs: str
    ) -> None:
        self.logs = logs
        self._process = process
        self._census = census
        self._mark = command.environ[TAG]
        self._group_gone = False
        self.pid = process.pid
        self.shown = " ".join(command.shown)

    def signal(self, number: int) -> None:
        """Signal the group and all descendants; what belongs to another user is left."""
        # The number of a group is taken for as long as the group has a member, or the leader has
        # not been reaped, so this cannot hit a stranger.
        if self._group_remains():
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, number)
        for pid in self._strays():
            with suppress(ProcessLookupError, PermissionError):
                os.kill(pid, number)

    def remains(self) -> bool:
        """Tell whether the group still has members, or a descendant lives outside it."""
        return self._group_remains() or bool(self._strays())

    def _group_remains(self) -> bool:
        if self._group_gone:
            return False
        if self._process.poll() is None:
            return True
        # Gone is for good: another process may get the number next.
        self._group_gone = not group_lives(self.pid)
        return not self._group_gone

    def _strays(self) -> list[int]:
        return [pid for pid in self._census.below(self._mark) if _group_of(pid) != self.pid]

    def code(self) -> int:
        """Reap the process, which has ended, and return its exit code."""
        return self._process.wait()


class LocalHost:
    """This machine.

    Args:
        loop: Where the ends of processes are awaited.
        output: What brings output to the screen.
        workplace: What commands are made from.
        folder: Where logs are kept; None when they cannot be.
        tag: Marks everything that this launch starts.
        prefixed: Whether lines on the screen begin with the name of their node.
    """

    place = ""

    def __init__(
        self,
        loop: Loop,
        output: Output,
        workplace: Workplace,
        *,
        folder: RunFolder | None,
        tag: str,
        prefixed: bool = False,
    ) -> None:
        self._loop = loop
        self._output = output
        self._workplace = workplace
        self._folder = folder
        self._tag = tag
        self._census = Census(tag)
        self._prefixed = prefixed

    def start(self, job: Job, ended: Ended, confirmed: Confirmed | None = None) -> LocalChild:
        """Start a process; the arguments and errors are those of `Host.start`."""
        del confirmed  # it runs when this returns
        log_file = self._folder.node_log(job.label) if self._folder else None
        tag = f"{self._tag}:{job.owner}"
        command = self._workplace.command(job.node, log_file=log_file, tag=tag)
        cwd = self._prepare(command.cwd)
        streams = self._streams(job, command)
        try:
            process = subprocess.Popen(
                command.argv,
                stdin=streams.stdin,
                stdout=streams.stdout,
                stderr=streams.stderr,
                env=_buffering(command, streams),
                cwd=cwd,
                start_new_session=True,
            )
        except (OSError, ValueError) as error:
            raise _refused(job, command, error) from error
        finally:
            streams.close()
        logs = self._folder.pattern(job.label) if self._folder else ""
        child = LocalChild(process, command, self._census, logs)

        def exited() -> None:
            code = child.code()
            self._output.drain(job.owner, lambda tail: ended(code, tail or self._logged(job)))

        self._loop.watch_exit(process.pid, exited)
        return child

    def measure(self, done: Callable[[dict[int, Usage]], None]) -> None:
        """Count what its processes have used, by their owners' numbers."""
        totals = usage(self._tag)
        owners = {mark.removeprefix(f"{self._tag}:"): total for mark, total in totals.items()}
        done({int(owner): total for owner, total in owners.items() if owner.isdigit()})

    def _streams(self, job: Job, command: Command) -> Streams:
        prefix = f"[{job.label}] " if self._prefixed else ""
        if command.direct and os.isatty(0):
            return self._output.direct()
        shown = job.node.output == "screen"
        file = self._folder.stdout_log(job.label) if self._folder and not shown else None
        try:
            if shown:
                return self._output.screen(job.owner, prefix)
            return self._output.log(job.owner, prefix, file, "a" if job.again else "w")
        except OSError as error:
            where = "the screen" if shown else f"'{file}'"
            raise LaunchError(
                f"cannot write the output of '{job.label}' to {where}: {error.strerror}"
            ) from error

    def _logged(self, job: Job) -> tuple[str, ...]:
        """Return the last lines that a process wrote to its file."""
        if self._folder is None or job.node.output == "screen":
            return ()
        return _last_lines(self._folder.stdout_log(job.label))

    @staticmethod
    def _prepare(cwd: str) -> str:
        try:
            Path(cwd).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise LaunchError(
                f"cannot start in '{cwd}': {error.strerror}; set ROS_HOME to a folder that can be"
                " written to"
            ) from error
        return cwd


def is_local(machine: MachinePlan | None) -> bool:
    """Tell whether a machine is this one, by its address, with the user that this process runs as.

    As in roslaunch, another user of this machine is reached over ssh.
    """
    if machine is None:
        return True
    if machine.user and machine.user != getpass.getuser():
        return False
    address = machine.address.lower()
    return address in _HERE or address == socket.gethostname().lower() or _is_ours(address)


def _is_ours(address: str) -> bool:
    """Tell whether a name or address leads to an interface of this machine."""
    try:
        found = socket.getaddrinfo(address, 0, type=socket.SOCK_DGRAM)
    except OSError:  # nobody knows it; ssh may, by its own configuration
        return False
    for family, kind, _, _, place in found:
        with socket.socket(family, kind) as probe, suppress(OSError):
            probe.bind(place)
            return True
    return False


def _buffering(command: Command, streams: Streams) -> Mapping[str, str]:
    """Have a Python program that rosz does not run itself write its lines as it prints them."""
    if command.python or streams.terminal:
        return command.environ
    return {"PYTHONUNBUFFERED": "1", **command.environ}


def _group_of(pid: int) -> int:
    """Return the process group of a process, or that of nobody when it is gone."""
    try:
        return os.getpgid(pid)
    except ProcessLookupError:
        return 0


def _refused(job: Job, command: Command, error: OSError | ValueError) -> LaunchError:
    number = error.errno if isinstance(error, OSError) else None
    if number == errno.ENOEXEC:
        return LaunchError(
            f"unable to launch [{job.label}]: '{command.argv[0]}' is no program; if it is a script,"
            " its first line must name what runs it, such as '#!/bin/sh'"
        )
    reason = error.strerror if isinstance(error, OSError) else str(error)
    hint = ""
    if number == errno.ENOENT and job.node.launch_prefix:
        hint = f"; is '{job.node.launch_prefix[0]}' of its launch-prefix installed?"
    elif number == errno.ENOENT:
        hint = "; does its first line name an interpreter that is installed?"
    return LaunchError(f"unable to launch [{job.label}]: {reason}: {' '.join(command.shown)}{hint}")


def _last_lines(file: Path, count: int = 12, size: int = 4096) -> tuple[str, ...]:
    try:
        with file.open("rb") as stream:
            stream.seek(max(0, os.fstat(stream.fileno()).st_size - size))
            data = stream.read(size)
    except OSError:  # nothing was written
        return ()
    lines = [line.rstrip() for line in data.decode(errors="replace").splitlines()]
    return tuple([line for line in lines if line][-count:])
