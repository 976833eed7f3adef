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

from rosz.errors import LaunchError, RoszError
from rosz.launch.plan import MachinePlan
from rosz.launch.run.command import NodeCommand, Workplace
from rosz.launch.run.excerpt import Excerpt, Position, make_excerpt, read_file
from rosz.launch.run.loop import Loop
from rosz.launch.run.output import RelayedOutput, RunFolder, Streams
from rosz.launch.run.process_tree import ProcessTree, Usage, group_alive
from rosz.launch.run.protocol import (
    Exited,
    Gone,
    ProcessReport,
    ProcessRequest,
    ProcessSpec,
    Refused,
    Start,
    Started,
)

OnReport = Callable[[ProcessReport], object]
"""Called on the loop with a report about a process."""

OnRead = Callable[[Excerpt], None]
"""Called with output of a process."""

_TAIL_BYTES, _TAIL_LINES = 4096, 12
# Most descendants end at once; each look for the others may read the environment of all processes.
_MIN_CHECK, _MAX_CHECK = 0.005, 0.1
_LOCAL_NAMES = frozenset({"", "localhost", "127.0.0.1", "::1"})


class Host(Protocol):
    """A machine that can start processes.

    Attributes:
        report: Receives what becomes of the processes.
    """

    report: OnReport

    @property
    def place(self) -> str:
        """Address, or "" for this machine."""

    def send(self, request: ProcessRequest) -> None:
        """Start a process, or signal one with its descendants unless they have ended."""

    def measure(self, done: Callable[[dict[int, Usage]], None]) -> None:
        """Call a function with the resources that the processes use, by owner."""

    def read_output(self, owner: int, after: Position | None, done: OnRead) -> None:
        """Call a function with the newest output of a process.

        Args:
            owner: Number of the process.
            after: Position of the output that is known already; None for the newest output.
            done: Called on the loop.
        """


class LocalChild:
    """A process of this machine, in a session and process group of its own."""

    def __init__(self, process: subprocess.Popen[bytes], tree: ProcessTree, tag: str) -> None:
        self.pid = process.pid
        self._process = process
        self._tree = tree
        self._tag = tag
        self._group_gone = False

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


class LocalHost:
    """This machine."""

    place = ""

    def __init__(
        self,
        loop: Loop,
        output: RelayedOutput,
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
        self._children: dict[int, LocalChild] = {}
        self.report: OnReport = lambda _: None

    @property
    def is_idle(self) -> bool:
        """Whether no process or descendant runs."""
        return not self._children

    def send(self, request: ProcessRequest) -> None:
        """Start a process, or signal one; see `Host.send`."""
        if isinstance(request, Start):
            try:
                self._start(request.serial, request.job)
            except RoszError as error:
                self.report(Refused(request.serial, str(error)))
        elif request.serial in self._children:
            self._children[request.serial].signal(request.number)

    def signal_all(self, number: int) -> None:
        """Signal all processes and their descendants."""
        for child in self._children.values():
            child.signal(number)

    def _start(self, serial: int, spec: ProcessSpec) -> None:
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
        self._children[serial] = LocalChild(process, self._tree, tag)

        def exited() -> None:
            code = process.wait()
            self._output.drain(spec.owner, lambda tail: ended(code, tail or self._logged(spec)))

        def ended(code: int, tail: tuple[str, ...]) -> None:
            self.report(Exited(serial, code, tail))
            self._check_gone(serial, _MIN_CHECK)

        self._loop.watch_exit(process.pid, exited)
        self.report(Started(serial, process.pid, " ".join(command.shown), logs))

    def _check_gone(self, serial: int, interval: float) -> None:
        """Report when a process and all its descendants have ended."""
        if self._children[serial].remains():
            longer = min(2 * interval, _MAX_CHECK)
            self._loop.later(interval, lambda: self._check_gone(serial, longer))
        else:
            del self._children[serial]
            self.report(Gone(serial))

    def measure(self, done: Callable[[dict[int, Usage]], None]) -> None:
        """Call a function with the resources that the processes use, by owner."""
        totals = self._tree.usage()
        owners = {tag.removeprefix(f"{self._tree.tag}:"): total for tag, total in totals.items()}
        done({int(owner): total for owner, total in owners.items() if owner.isdigit()})

    def read_output(self, owner: int, after: Position | None, done: OnRead) -> None:
        """Call a function with the newest output of a process; see `Host.read_output`."""
        position = after or (0, 0)

        def shown(screen: tuple[int, bytes]) -> None:
            file = read_file(self._files.get(owner), position[0])
            done(make_excerpt(file, screen, after))

        self._output.read(owner, position[1], shown)

    def _open_streams(self, spec: ProcessSpec, command: NodeCommand) -> Streams:
        prefix = f"[{spec.label}] " if self._prefixed else ""
        if command.direct and os.isatty(0):
            # A debugger needs the streams of the launch itself.
            return Streams(None, None, None, terminal=os.isatty(1))
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
        if self._folder is None or spec.node.output == "screen":
            return ()
        _, data = read_file(self._folder.stdout_log(spec.label), 0, _TAIL_BYTES)
        lines = [line.rstrip() for line in data.decode(errors="replace").splitlines()]
        return tuple([line for line in lines if line][-_TAIL_LINES:])


def is_local(machine: MachinePlan | None) -> bool:
    """Return whether a machine is this one, by its address and user.

    As in roslaunch, another user of this machine is reached over ssh.
    """
    if machine is None:
        return True
    if machine.user and machine.user != getpass.getuser():
        return False
    return is_local_address(machine.address)


def is_local_address(address: str) -> bool:
    """Return whether a name or address is that of this machine."""
    address = address.lower()
    return address in _LOCAL_NAMES or address == socket.gethostname().lower() or _is_own(address)


def _is_own(address: str) -> bool:
    """Return whether a name or address belongs to an interface of this machine."""
    try:
        addresses = socket.getaddrinfo(address, 0, type=socket.SOCK_DGRAM)
    except OSError:  # an unknown name; the user's ssh configuration may define it
        return False
    for family, kind, _, _, place in addresses:
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


def _with_line_buffering(command: NodeCommand, streams: Streams) -> Mapping[str, str]:
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


def _start_error(
    spec: ProcessSpec, command: NodeCommand, error: OSError | ValueError
) -> LaunchError:
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
