"""The machines that processes run on: `LocalHost` is this one, `remote.RemoteHost` another."""

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
from rosz.launch.plan import MachinePlan, NodePlan
from rosz.launch.run.command import Command, Workplace
from rosz.launch.run.excerpt import Excerpt, Position, make_excerpt, read_file
from rosz.launch.run.loop import Loop
from rosz.launch.run.output import Output, RunFolder, Streams
from rosz.launch.run.process_tree import TAG, ProcessTree, Usage, group_alive

__all__ = (
    "Child",
    "Host",
    "LocalChild",
    "LocalHost",
    "OnExit",
    "OnRead",
    "OnStart",
    "ProcessSpec",
    "is_local",
)

OnExit = Callable[[int | None, tuple[str, ...]], None]
"""Called with the exit code, negative for a signal, and the last lines of the output.

The exit code is None if it is not known, because the machine of the process is lost.
"""

OnStart = Callable[[RoszError | None], None]
"""Called with None once a process has started, or with the reason why it could not be."""

OnRead = Callable[[Excerpt], None]
"""Called with output of a process."""

_LOCAL_NAMES = frozenset({"", "localhost", "127.0.0.1", "::1"})


class ProcessSpec(msgspec.Struct, frozen=True):
    """A process to start.

    Attributes:
        node: The node from the plan.
        owner: Number of the process in this launch.
        label: Name that messages show.
        again: Whether it ran before in this launch.
    """

    node: NodePlan
    owner: int
    label: str
    again: bool = False


class Child(Protocol):
    """A started process with its descendants."""

    @property
    def pid(self) -> int:
        """Process id on its machine."""

    @property
    def shown(self) -> str:
        """Command line that messages show."""

    @property
    def logs(self) -> str:
        """Pattern of the paths of its logs on its machine, or "" if there are none."""

    @property
    def place(self) -> str:
        """Address of its machine, or "" for this one."""

    @property
    def pending(self) -> bool:
        """Whether its machine has not confirmed yet that it runs."""

    def signal(self, number: int) -> None:
        """Send a signal to it and its descendants; those that have ended are ignored."""

    def remains(self) -> bool:
        """Return whether it or a descendant still runs."""


class Host(Protocol):
    """A machine that can start processes."""

    @property
    def place(self) -> str:
        """Address, or "" for this machine."""

    def start(self, spec: ProcessSpec, on_exit: OnExit, on_start: OnStart) -> Child:
        """Start a process.

        Args:
            spec: The process.
            on_exit: Called on the loop when the process itself has ended.
            on_start: Called on the loop for a pending child, when it is no longer pending.

        Raises:
            PackageNotFound: If the machine has no such package.
            ExecutableNotFound: If the package has no such executable.
            LaunchError: If the system refuses to start it.
        """

    def measure(self, done: Callable[[dict[int, Usage]], None]) -> None:
        """Call a function with the resources that the processes use, by owner."""

    def read_output(self, owner: int, after: Position | None, done: OnRead) -> None:
        """Call a function with the newest output of a process.

        Args:
            owner: Number of the process.
            after: Position of what is known already; None for the newest output.
            done: Called on the loop.
        """


class LocalChild:
    """A process of this machine, in a session and process group of its own.

    Args:
        process: The process.
        command: The command that it runs.
        tree: The processes of this launch, to find descendants outside the group.
        logs: Pattern of the paths of its logs.
    """

    place = ""
    pending = False

    def __init__(
        self, process: subprocess.Popen[bytes], command: Command, tree: ProcessTree, logs: str
    ) -> None:
        self.logs = logs
        self._process = process
        self._tree = tree
        self._tag = command.environ[TAG]
        self._group_gone = False
        self.pid = process.pid
        self.shown = " ".join(command.shown)

    def signal(self, number: int) -> None:
        """Signal the group and all descendants, except those of another user."""
        # The number of a group is in use for as long as the group has a member, or its leader has
        # not been reaped, so this cannot reach an unrelated process.
        if self._group_remains():
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, number)
        for pid in self._outside_group():
            with suppress(ProcessLookupError, PermissionError):
                os.kill(pid, number)

    def remains(self) -> bool:
        """Return whether the group has members, or a descendant runs outside it."""
        return self._group_remains() or bool(self._outside_group())

    def _group_remains(self) -> bool:
        if self._group_gone:
            return False
        if self._process.poll() is None:
            return True
        # Remembered, because another group may get the number next.
        self._group_gone = not group_alive(self.pid)
        return not self._group_gone

    def _outside_group(self) -> list[int]:
        return [pid for pid in self._tree.below(self._tag) if _group_of(pid) != self.pid]

    def reap(self) -> int:
        """Reap the process, which has ended, and return its exit code."""
        return self._process.wait()


class LocalHost:
    """This machine.

    Args:
        loop: Loop that waits for the processes.
        output: Relay of their output.
        workplace: Source of their commands.
        folder: Folder of their logs, or None if logs cannot be kept.
        tag: Tag of everything that this launch starts.
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
        self._tree = ProcessTree(tag)
        self._prefixed = prefixed
        self._files: dict[int, Path] = {}

    def start(
        self,
        spec: ProcessSpec,
        on_exit: Callable[[int, tuple[str, ...]], None],
        on_start: OnStart | None = None,
    ) -> LocalChild:
        """Start a process; see `Host.start` for the arguments and errors."""
        del on_start  # the process runs when this returns
        log_file = self._folder.node_log(spec.label) if self._folder else None
        tag = f"{self._tree.tag}:{spec.owner}"
        command = self._workplace.command(spec.node, log_file=log_file, tag=tag)
        _make_folder(command.cwd)
        streams = self._open_streams(spec, command)
        try:
            process = subprocess.Popen(
                command.argv,
                stdin=streams.stdin,
                stdout=streams.stdout,
                stderr=streams.stderr,
                env=_with_line_buffering(command, streams),
                cwd=command.cwd,
                start_new_session=True,
            )
        except (OSError, ValueError) as error:
            raise _start_error(spec, command, error) from error
        finally:
            streams.close()
        self._output.started(spec.owner, process.pid)
        logs = self._folder.pattern(spec.label) if self._folder else ""
        child = LocalChild(process, command, self._tree, logs)

        def exited() -> None:
            code = child.reap()
            self._output.drain(spec.owner, lambda tail: on_exit(code, tail or self._logged(spec)))

        self._loop.watch_exit(process.pid, exited)
        return child

    def measure(self, done: Callable[[dict[int, Usage]], None]) -> None:
        """Call a function with the resources that the processes use, by owner."""
        totals = self._tree.usage()
        owners = {tag.removeprefix(f"{self._tree.tag}:"): total for tag, total in totals.items()}
        done({int(owner): total for owner, total in owners.items() if owner.isdigit()})

    def read_output(self, owner: int, after: Position | None, done: OnRead) -> None:
        """Call a function with the newest output of a process; see `Host.read_output`."""
        known = after or (0, 0)

        def shown(begin: int, data: bytes) -> None:
            file = read_file(self._files.get(owner), known[0])
            done(make_excerpt(file, (begin, data), after))

        self._output.read(owner, known[1], shown)

    def _open_streams(self, spec: ProcessSpec, command: Command) -> Streams:
        prefix = f"[{spec.label}] " if self._prefixed else ""
        if command.direct and os.isatty(0):
            return self._output.direct()
        shown = spec.node.output == "screen"
        file = self._folder.stdout_log(spec.label) if self._folder and not shown else None
        try:
            if shown:
                return self._output.screen(spec.owner, prefix)
            if file is not None:
                self._files[spec.owner] = file
            return self._output.log(spec.owner, prefix, file, "a" if spec.again else "w")
        except OSError as error:
            where = "the screen" if shown else f"'{file}'"
            raise LaunchError(
                f"cannot write the output of '{spec.label}' to {where}: {error.strerror}"
            ) from error

    def _logged(self, spec: ProcessSpec) -> tuple[str, ...]:
        """Return the last lines that a process wrote to its file."""
        if self._folder is None or spec.node.output == "screen":
            return ()
        return _last_lines(self._folder.stdout_log(spec.label))


def is_local(machine: MachinePlan | None) -> bool:
    """Return whether a machine is this one, by its address and user.

    As in roslaunch, another user of this machine is reached over ssh.
    """
    if machine is None:
        return True
    if machine.user and machine.user != getpass.getuser():
        return False
    address = machine.address.lower()
    return address in _LOCAL_NAMES or address == socket.gethostname().lower() or _is_own(address)


def _is_own(address: str) -> bool:
    """Return whether a name or address belongs to an interface of this machine."""
    try:
        found = socket.getaddrinfo(address, 0, type=socket.SOCK_DGRAM)
    except OSError:  # an unknown name; the user's ssh configuration may define it
        return False
    for family, kind, _, _, place in found:
        with socket.socket(family, kind) as probe, suppress(OSError):
            probe.bind(place)
            return True
    return False


def _make_folder(cwd: str) -> None:
    try:
        Path(cwd).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise LaunchError(
            f"cannot start in '{cwd}': {error.strerror}; set ROS_HOME to a folder that can be"
            " written to"
        ) from error


def _with_line_buffering(command: Command, streams: Streams) -> Mapping[str, str]:
    """Return variables that make a Python program not run by rosz write lines at once."""
    if command.python or streams.terminal:
        return command.environ
    return {"PYTHONUNBUFFERED": "1", **command.environ}


def _group_of(pid: int) -> int:
    """Return the process group of a process, or 0 if it has ended."""
    try:
        return os.getpgid(pid)
    except ProcessLookupError:
        return 0


def _start_error(spec: ProcessSpec, command: Command, error: OSError | ValueError) -> LaunchError:
    number = error.errno if isinstance(error, OSError) else None
    if number == errno.ENOEXEC:
        return LaunchError(
            f"unable to launch [{spec.label}]: '{command.argv[0]}' is not a program; if it is a"
            " script, its first line must name its interpreter, such as '#!/bin/sh'"
        )
    reason = error.strerror if isinstance(error, OSError) else str(error)
    hint = ""
    if number == errno.ENOENT and spec.node.launch_prefix:
        hint = f"; is '{spec.node.launch_prefix[0]}' of its launch-prefix installed?"
    elif number == errno.ENOENT:
        hint = "; does its first line name an interpreter that is installed?"
    shown = " ".join(command.shown)
    return LaunchError(f"unable to launch [{spec.label}]: {reason}: {shown}{hint}")


def _last_lines(file: Path, count: int = 12, size: int = 4096) -> tuple[str, ...]:
    try:
        with file.open("rb") as stream:
            stream.seek(max(0, os.fstat(stream.fileno()).st_size - size))
            data = stream.read(size)
    except OSError:  # there is no file
        return ()
    lines = [line.rstrip() for line in data.decode(errors="replace").splitlines()]
    return tuple([line for line in lines if line][-count:])
