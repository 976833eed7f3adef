"""Other machines: the launch's side of the agents there, over the pipes of the system's ssh."""

from __future__ import annotations

import codecs
import itertools
import os
import subprocess
from collections.abc import Callable, Mapping

import msgspec

from rosz.errors import LaunchError
from rosz.launch.plan import MachinePlan
from rosz.launch.run import protocol
from rosz.launch.run.console import Console
from rosz.launch.run.excerpt import Excerpt, Position
from rosz.launch.run.host import OnRead, OnReport
from rosz.launch.run.loop import Loop
from rosz.launch.run.machines import ssh_command, ssh_failure
from rosz.launch.run.process_tree import Usage
from rosz.launch.run.protocol import AgentSetup, LineReader, MessageWriter, rosz_version

_PINGS = 4
_KEPT_LINES = 40
_CLOSE_TIMEOUT = 5.0
_DECODER = msgspec.json.Decoder(protocol.Report)


class RemoteHost:
    """A machine reached by ssh.

    Attributes:
        place: Address.
        error: Reason why it cannot be used, or "".
        ready: Whether its agent accepts requests.
    """

    def __init__(
        self, machine: MachinePlan, name: str, loop: Loop, console: Console, setup: AgentSetup
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
        self._pending: set[int] = set()  # processes that its agent has not started yet
        self._running: set[int] = set()
        self.report: OnReport = lambda _: None
        self._measuring: list[Callable[[dict[int, Usage]], None]] = []
        self._reading: dict[int, tuple[OnRead, Position | None]] = {}
        self._errors: list[str] = []
        self._connected = False
        self._closing = False
        # Output may be cut anywhere, even within a character.
        utf8 = codecs.getincrementaldecoder("utf-8")
        self._texts = {sink: utf8("replace") for sink in (1, 2)}
        self._ssh = _run_ssh(machine, name, setup.silence, console)
        assert self._ssh.stdin is not None  # noqa: S101  # all three are pipes
        assert self._ssh.stdout is not None  # noqa: S101
        assert self._ssh.stderr is not None  # noqa: S101
        self._out = LineReader(self._ssh.stdout.fileno())
        self._err = LineReader(self._ssh.stderr.fileno())
        self._writer = MessageWriter(os.dup(self._ssh.stdin.fileno()))
        self._ssh.stdin.close()
        loop.watch(self._out.fd, self._read_reports)
        loop.watch(self._err.fd, self._read_errors)
        loop.watch_exit(self._ssh.pid, self._ssh_ended)
        self._request(setup)
        silent = f"'{self.place}' does not answer within {machine.timeout:g} s"
        self._timeout = loop.later(machine.timeout, lambda: self._fail(silent))
        self._ping()

    def send(self, request: protocol.ProcessRequest) -> None:
        """Start a process, or signal one; see `Host.send`."""
        if isinstance(request, protocol.Start):
            if self.error:
                self.report(protocol.Refused(request.serial, self.error))
                return
            self._pending.add(request.serial)
        self._request(request)

    def measure(self, done: Callable[[dict[int, Usage]], None]) -> None:
        """Call a function with the resources of its processes, which are none if it is lost."""
        if self.error:
            done({})
            return
        self._measuring.append(done)
        self._request(protocol.Measure())

    def read_output(self, owner: int, after: Position | None, done: OnRead) -> None:
        """Call a function with the newest output of a process, which is none if it is lost."""
        if self.error:
            done(Excerpt("", after or (0, 0)))
            return
        number = next(self._serials)
        self._reading[number] = (done, after)
        self._request(protocol.ReadOutput(number, owner, after))

    def _request(self, message: msgspec.Struct) -> None:
        """Send a request to the agent; it is dropped if the machine is lost."""
        if not self.error:
            self._writer.send(message)

    def _ping(self) -> None:
        if not self.error and not self._closing:
            self._request(protocol.Ping())
            self._loop.later(self._silence / _PINGS, self._ping)

    def _read_reports(self) -> None:
        for line in self._out.read():
            self._handle(line)
        if self._out.ended:
            self._loop.unwatch(self._out.fd)
        elif self._console.full:
            self._loop.unwatch(self._out.fd)
            self._console.when_free(lambda: self._loop.post(self._resume_reading))

    def _resume_reading(self) -> None:
        """Read on after a pause, in which the console was full."""
        if self._out.fd >= 0 and not self._out.ended:
            self._loop.unwatch(self._out.fd)
            self._loop.watch(self._out.fd, self._read_reports)

    def _read_errors(self) -> None:
        for line in self._err.read():
            text = self._keep_line(line)
            if self._connected and text:
                self._console.error(f"remote[{self._name}]: {text}")
        if self._err.ended:
            self._loop.unwatch(self._err.fd)

    def _keep_line(self, line: bytes) -> str:
        """Keep a line that may explain a failure, and return it as text."""
        text = line.decode(errors="replace").rstrip()
        self._errors = [*self._errors[-_KEPT_LINES:], text]
        return text

    def _handle(self, line: bytes) -> None:
        try:
            report = _DECODER.decode(line)
        except msgspec.MsgspecError:
            if self._connected:
                self._fail(f"'{self.place}' sent a message that is not valid: {line[:80]!r}")
            else:  # text of a login, which may explain why there will be no agent
                self._keep_line(line)
            return
        if isinstance(report, protocol.AgentVersion):
            self._check_version(report)
        elif isinstance(report, protocol.Ready):
            self._set_ready(report)
        elif isinstance(report, protocol.AgentWarning):
            self._console.error(f"remote[{self._name}]: {report.text}")
        elif isinstance(report, protocol.Shown):
            self._console.show(report.sink, self._texts[report.sink].decode(report.data))
        elif isinstance(report, protocol.Measured):
            self._report_usage(report.used)
        elif isinstance(report, protocol.OutputRead):
            if report.number in self._reading:
                self._reading.pop(report.number)[0](report.excerpt)
        else:
            self._pass_on(report)

    def _report_usage(self, used: dict[int, Usage]) -> None:
        waiting, self._measuring = self._measuring, []
        for done in waiting:
            done(used)

    def _check_version(self, agent: protocol.AgentVersion) -> None:
        here = rosz_version()
        if agent.protocol != protocol.PROTOCOL:
            self._fail(
                f"rosz {agent.version} on '{self.place}' does not work with rosz {here} here: its"
                f" agent speaks protocol {agent.protocol}, expected {protocol.PROTOCOL}; install"
                " the same version on both"
            )
            return
        self._connected = True
        if agent.version != here:
            self._console.error(
                f"WARNING: remote[{self._name}]: rosz {agent.version} there, {here} here"
            )

    def _set_ready(self, ready: protocol.Ready) -> None:
        self._timeout.cancel()
        self.ready = True
        self._console.say(f"remote[{self._name}]: ssh connection created")
        if ready.reaches:
            self._console.note(f"remote[{self._name}]: nodes there connect to {ready.reaches}")
        else:
            self._console.error(
                f"WARNING: remote[{self._name}]: nodes there will not find this launch: run 'rosz"
                " core --listen tcp/0.0.0.0:7447' here, or set ROSZ_CONNECT there"
            )

    def _pass_on(self, report: protocol.ProcessReport) -> None:
        self._pending.discard(report.serial)
        if isinstance(report, protocol.Started):
            self._running.add(report.serial)
        elif isinstance(report, protocol.Refused):
            report = protocol.Refused(report.serial, f"on '{self.place}': {report.text}")
        elif isinstance(report, protocol.Gone):
            self._running.discard(report.serial)
        self.report(report)

    def _ssh_ended(self) -> None:
        code = self._ssh.wait()
        self._read_reports()
        self._read_errors()
        if self._closing:
            return
        output = "\n".join(self._errors)
        if not self._connected:
            self._fail(ssh_failure(self._machine, code, output))
        elif "not responding" in output or "Broken pipe" in output or "reset" in output:
            self._fail(f"'{self.place}' is lost: it does not answer any more")
        else:
            self._fail(f"'{self.place}' is lost: its agent has ended, or the machine went down")

    def _fail(self, why: str) -> None:
        """Give up the machine and all processes there."""
        if self.error:
            return
        self.error = f"machine '{self._machine.name}': {why}"
        self._timeout.cancel()
        if self.ready:
            self._console.error(f"remote[{self._name}]: {why}")
        self._ssh.kill()
        self._report_usage({})
        reading, self._reading = self._reading, {}
        for done, after in reading.values():
            done(Excerpt("", after or (0, 0)))
        pending, self._pending = self._pending, set()
        running, self._running = self._running, set()
        for serial in sorted(pending):
            self.report(protocol.Refused(serial, self.error))
        for serial in sorted(running):
            self.report(protocol.Exited(serial, None, (self.error,)))
            self.report(protocol.Gone(serial))

    def disconnect(self) -> None:
        """Let the agent end with all that it runs, without waiting for it."""
        self._closing = True
        self._timeout.cancel()
        self._writer.close(0)

    def close(self) -> None:
        """End the agent and the connection; a second call has no effect."""
        self.disconnect()
        if self._out.fd < 0:
            return
        try:
            self._ssh.wait(0 if self.error else _CLOSE_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._ssh.kill()
            self._ssh.wait()
        for lines in (self._out, self._err):
            self._loop.unwatch(lines.fd)
            lines.fd = -1
        for stream in (self._ssh.stdout, self._ssh.stderr):
            if stream is not None:
                stream.close()


def _run_ssh(
    machine: MachinePlan, name: str, silence: float, console: Console
) -> subprocess.Popen[bytes]:
    user = f", user[{machine.user}]" if machine.user else ""
    where = f"{machine.address}:{machine.ssh_port}{user}"
    console.say(f"remote[{name}]: creating ssh connection to {where}")
    command, pipe = ssh_command(machine, silence), subprocess.PIPE
    console.note(f"remote[{name}]: {' '.join(command)}")
    try:
        return subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=pipe, start_new_session=True
        )
    except FileNotFoundError as error:
        raise LaunchError(
            f"{machine.place}: machine '{machine.name}' needs ssh, which is not installed"
        ) from error
    except OSError as error:
        raise LaunchError(f"{machine.place}: cannot run ssh: {error.strerror}") from error


class Machines:
    """All other machines of one launch."""

    def __init__(self, loop: Loop, console: Console) -> None:
        self._loop = loop
        self._console = console
        self._hosts: list[RemoteHost] = []

    def connect(
        self, machines: Mapping[str, MachinePlan], setup: AgentSetup
    ) -> dict[str, RemoteHost]:
        """Start the agents of all machines, and wait until they are ready.

        Raises:
            LaunchError: If an agent does not start; the message gives the reason for each.
        """
        hosts = {}
        for number, (name, machine) in enumerate(machines.items()):
            if machine.password:
                self._console.error(
                    f"WARNING: {machine.place}: the password of machine '{name}' is not used: a"
                    " launch file is not the place for one; give that machine your key instead,"
                    f" once: ssh-copy-id {f'{machine.user}@' if machine.user else ''}"
                    f"{machine.address}"
                )
            there = msgspec.structs.replace(setup, tag=f"{setup.tag}:at{number}")
            host = RemoteHost(
                machine, f"{machine.address}-{number}", self._loop, self._console, there
            )
            self._hosts.append(host)
            hosts[name] = host
        while any(not host.ready and not host.error for host in self._hosts):
            self._loop.step()
        errors = [host.error for host in self._hosts if host.error]
        if errors:
            raise LaunchError("\n".join(errors))
        return hosts

    def close(self) -> None:
        """End all agents with their processes; a second call has no effect."""
        for host in self._hosts:
            host.disconnect()
        for host in self._hosts:
            host.close()
