"""Other machines: a launch's side of the agents there, over the pipes of the system's ssh."""

from __future__ import annotations

import codecs
import itertools
import os
import subprocess
from collections.abc import Callable, Sequence

import msgspec

from rosz.errors import LaunchError
from rosz.launch.plan.model import MachinePlan
from rosz.launch.run.console import Console
from rosz.launch.run.family import Usage
from rosz.launch.run.host import Confirmed, Ended, Job
from rosz.launch.run.loop import Loop, Timer
from rosz.launch.run.pipe import Lines, Outbox
from rosz.launch.run.protocol import (
    PROTOCOL,
    Exited,
    Gone,
    Hello,
    Measure,
    Measured,
    Notice,
    Ping,
    Ready,
    Refused,
    Report,
    Setup,
    Shown,
    Signal,
    Start,
    Started,
    rosz_version,
)
from rosz.launch.run.ssh import ssh_command, ssh_failure

__all__ = ("RemoteChild", "RemoteHost", "await_hosts")

LOST = 255
"""Exit code of a process whose machine is lost, which is that of ssh then."""

_PINGS = 4
_SAID = 40
_END_SECONDS = 5.0


class RemoteChild:
    """A process of another machine.

    Args:
        host: The machine.
        serial: What it is called between here and there.
        ended: Called when it has ended.
        confirmed: Called when it has been started, or refused.
    """

    def __init__(
        self, host: RemoteHost, serial: int, ended: Ended, confirmed: Confirmed | None
    ) -> None:
        self.pid = 0
        self.shown = ""
        self.logs = ""
        self.place = host.place
        self.pending = True
        self.gone = False
        self.ended: Ended | None = ended
        self.confirmed: Confirmed | None = confirmed
        self._host = host
        self._serial = serial

    def signal(self, number: int) -> None:
        """Signal it and its descendants."""
        self._host.send(Signal(self._serial, number))

    def remains(self) -> bool:
        """Tell whether it or a descendant is still there."""
        return not self.gone


class RemoteHost:
    """A machine that ssh leads to.

    Args:
        machine: The machine.
        name: What messages call the link to it.
        loop: Where its answers are awaited.
        console: Where its output goes, and what happens to it is said.
        setup: What its agent has to know.

    Attributes:
        place: Its address.
        error: Why it cannot be used; empty as long as it can.
        ready: Whether its agent waits for orders.
    """

    def __init__(
        self, machine: MachinePlan, name: str, loop: Loop, console: Console, setup: Setup
    ) -> None:
        self.place = machine.address
        self.error = ""
        self.ready = False
        self._machine = machine
        self._name = name
        self._loop = loop
        self._console = console
        self._silence = setup.silence
        self._serials = itertools.count(1)
        self._children: dict[int, RemoteChild] = {}
        self._measuring: list[Callable[[dict[int, Usage]], None]] = []
        self._said: list[str] = []
        self._greeted = False
        self._closing = False
        self._decoder = msgspec.json.Decoder(Report)
        # What comes is cut anywhere, also within a letter.
        utf8 = codecs.getincrementaldecoder("utf-8")
        self._texts = {sink: utf8("replace") for sink in (1, 2)}
        self._ssh = self._call()
        assert self._ssh.stdin is not None  # noqa: S101  # all three are pipes
        assert self._ssh.stdout is not None  # noqa: S101
        assert self._ssh.stderr is not None  # noqa: S101
        self._out = Lines(self._ssh.stdout.fileno())
        self._err = Lines(self._ssh.stderr.fileno())
        self._outbox = Outbox(os.dup(self._ssh.stdin.fileno()))
        self._ssh.stdin.close()
        loop.watch(self._out.fd, self._heard)
        loop.watch(self._err.fd, self._overheard)
        loop.watch_exit(self._ssh.pid, self._ended)
        self.send(setup)
        self._patience: Timer | None = loop.later(machine.timeout, self._late)
        self._ping()

    def _call(self) -> subprocess.Popen[bytes]:
        machine = self._machine
        user = f", user[{machine.user}]" if machine.user else ""
        where = f"{self.place}:{machine.ssh_port}{user}"
        self._console.say(f"remote[{self._name}]: creating ssh connection to {where}")
        command = ssh_command(machine, self._silence)
        self._console.note(f"remote[{self._name}]: {' '.join(command)}")
        try:
            return subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                start_new_session=True,
            )
        except FileNotFoundError as error:
            raise LaunchError(
                f"{machine.place}: machine '{machine.name}' needs ssh, which is not installed"
            ) from error
        except OSError as error:
            raise LaunchError(f"{machine.place}: cannot run ssh: {error.strerror}") from error

    def start(self, job: Job, ended: Ended, confirmed: Confirmed) -> RemoteChild:
        """Start a process; the arguments and errors are those of `Host.start`."""
        if self.error:
            raise LaunchError(self.error)
        serial = next(self._serials)
        child = self._children[serial] = RemoteChild(self, serial, ended, confirmed)
        self.send(Start(serial, job))
        return child

    def measure(self, done: Callable[[dict[int, Usage]], None]) -> None:
        """Have what its processes have used counted, by owner; nothing when it is lost."""
        if self.error:
            done({})
            return
        self._measuring.append(done)
        self.send(Measure())

    def send(self, message: msgspec.Struct) -> None:
        """Send something to the agent; to one that is lost it is lost as well."""
        if not self.error:
            self._outbox.send(message)

    def _ping(self) -> None:
        if not self.error and not self._closing:
            self.send(Ping())
            self._loop.later(self._silence / _PINGS, self._ping)

    def _late(self) -> None:
        self._fail(f"'{self.place}' does not answer within {self._machine.timeout:g} s")

    def _heard(self) -> None:
        for line in self._out.read():
            self._take(line)
        if self._out.ended:
            self._loop.unwatch(self._out.fd)
        elif self._console.full:
            self._loop.unwatch(self._out.fd)
            self._console.when_free(lambda: self._loop.post(self._listen))

    def _listen(self) -> None:
        """Go on with what comes, after more of it came than the screen took."""
        if self._out.fd >= 0 and not self._out.ended:
            self._loop.unwatch(self._out.fd)
            self._loop.watch(self._out.fd, self._heard)

    def _overheard(self) -> None:
        for line in self._err.read():
            text = line.decode(errors="replace").rstrip()
            self._said = [*self._said[-_SAID:], text]
            if self._greeted and text:
                self._console.error(f"remote[{self._name}]: {text}")
        if self._err.ended:
            self._loop.unwatch(self._err.fd)

    def _take(self, line: bytes) -> None:
        try:
            report = self._decoder.decode(line)
        except msgspec.MsgspecError:
            if self._greeted:
                self._fail(f"what comes from '{self.place}' makes no sense: {line[:80]!r}")
            else:  # printed by a login; it may tell why there will be no agent
                self._said = [*self._said[-_SAID:], line.decode(errors="replace").rstrip()]
            return
        if isinstance(report, Hello):
            self._greet(report)
        elif isinstance(report, Ready):
            self._settle(report)
        elif isinstance(report, Notice):
            self._console.error(f"remote[{self._name}]: {report.text}")
        elif isinstance(report, Shown):
            self._console.show(report.sink, self._texts[report.sink].decode(report.data))
        elif isinstance(report, Measured):
            waiting, self._measuring = self._measuring, []
            for done in waiting:
                done(report.used)
        else:
            self._update(report)

    def _greet(self, hello: Hello) -> None:
        here = rosz_version()
        if hello.protocol != PROTOCOL:
            self._fail(
                f"rosz {hello.version} on '{self.place}' does not go with rosz {here} here: its"
                f" agent speaks protocol {hello.protocol}, expected {PROTOCOL}; install the same"
                " version on both"
            )
            return
        self._greeted = True
        if hello.version != here:
            self._console.error(
                f"WARNING: remote[{self._name}]: rosz {hello.version} there, {here} here"
            )

    def _settle(self, ready: Ready) -> None:
        if self._patience is not None:
            self._patience.cancel()
        self.ready = True
        self._console.say(f"remote[{self._name}]: ssh connection created")
        if ready.reaches:
            self._console.note(f"remote[{self._name}]: nodes there link to {ready.reaches}")
        else:
            self._console.error(
                f"WARNING: remote[{self._name}]: nodes there will not find this launch: run 'rosz"
                " core --listen tcp/0.0.0.0:7447' here, or set ROSZ_CONNECT there"
            )

    def _update(self, report: Started | Refused | Exited | Gone) -> None:
        child = self._children.get(report.serial)
        if child is None:
            return
        if isinstance(report, Started):
            child.pending = False
            child.pid, child.shown, child.logs = report.pid, report.shown, report.logs
            self._confirm(child, None)
        elif isinstance(report, Refused):
            child.pending, child.gone = False, True
            del self._children[report.serial]
            self._confirm(child, LaunchError(f"on '{self.place}': {report.text}"))
        elif isinstance(report, Exited):
            self._bury(child, report.code, report.tail)
        else:
            child.gone = True
            del self._children[report.serial]

    @staticmethod
    def _confirm(child: RemoteChild, error: LaunchError | None) -> None:
        confirmed, child.confirmed = child.confirmed, None
        if confirmed is not None:
            confirmed(error)

    @staticmethod
    def _bury(child: RemoteChild, code: int, tail: tuple[str, ...]) -> None:
        ended, child.ended = child.ended, None
        if ended is not None:
            ended(code, tail)

    def _ended(self) -> None:
        """Take note that ssh has ended, whatever the reason."""
        code = self._ssh.wait()
        self._heard()
        self._overheard()
        if self._closing:
            return
        said = "\n".join(self._said)
        if not self._greeted:
            self._fail(ssh_failure(self._machine, code, said))
        elif "not responding" in said or "Broken pipe" in said or "reset" in said:
            self._fail(f"'{self.place}' is lost: it does not answer any more")
        else:
            self._fail(f"'{self.place}' is lost: its agent has ended, or the machine went down")

    def _fail(self, why: str) -> None:
        """Give the machine up, with all that runs there."""
        if self.error:
            return
        machine = self._machine
        self.error = f"machine '{machine.name}': {why}"
        if self._patience is not None:
            self._patience.cancel()
        if self.ready:
            self._console.error(f"remote[{self._name}]: {why}")
        self._ssh.kill()
        waiting, self._measuring = self._measuring, []
        for done in waiting:
            done({})
        children, self._children = self._children, {}
        for child in children.values():
            child.gone = True
            if child.pending:
                self._confirm(child, LaunchError(self.error))
            else:
                self._bury(child, LOST, (self.error,))

    def hang_up(self) -> None:
        """Have the agent end with all that it runs, without waiting for it."""
        self._closing = True
        if self._patience is not None:
            self._patience.cancel()
        self._outbox.close(0)

    def close(self) -> None:
        """End the agent and the link; again is no error."""
        self.hang_up()
        if self._out.fd < 0:
            return
        try:
            self._ssh.wait(0 if self.error else _END_SECONDS)
        except subprocess.TimeoutExpired:
            self._ssh.kill()
            self._ssh.wait()
        for lines in (self._out, self._err):
            self._loop.unwatch(lines.fd)
            lines.fd = -1
        for stream in (self._ssh.stdout, self._ssh.stderr):
            if stream is not None:
                stream.close()


def await_hosts(hosts: Sequence[RemoteHost], loop: Loop) -> None:
    """Wait until all agents are there.

    Raises:
        LaunchError: One does not come up; the message says why of each.
    """
    while any(not host.ready and not host.error for host in hosts):
        loop.step()
    errors = [host.error for host in hosts if host.error]
    if errors:
        raise LaunchError("\n".join(errors))
