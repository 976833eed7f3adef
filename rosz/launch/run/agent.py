"""The agent of a launch on another machine, started by ssh and connected by its pipes.

It starts and ends processes as the launch does on its own machine, and keeps their logs there. It
ends them and itself when the launch closes the pipe, when the launch or the connection dies, and
when no message arrives for too long.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path

import msgspec

from rosz.environment import Environment, package_index
from rosz.errors import LaunchError, RoszError
from rosz.launch.plan import NodePlan
from rosz.launch.run import protocol
from rosz.launch.run.command import Workplace
from rosz.launch.run.host import LocalHost
from rosz.launch.run.loop import Loop, LoopTimer
from rosz.launch.run.output import RelayedOutput, RunFolder
from rosz.launch.run.process_tree import ProcessTree
from rosz.launch.run.protocol import AgentSetup, LineReader, MessageWriter, rosz_version
from rosz.session import first_listening, is_listening

FindMaster = Callable[[Mapping[str, str], Environment], tuple[str, dict[str, str]]]
"""Function that finds a master of ROS 1 by environment variables, and the settings in them.

It returns whose master it is, and the environment variables of the programs that have it."""

_SETUP_TIMEOUT = 60.0
_CONNECT_TIMEOUT = 1.0
_CLOSE_TIMEOUT = 1.0


class _Agent:
    """The processes of one launch on this machine."""

    def __init__(
        self,
        requests: LineReader,
        reports: int,
        screens: Mapping[int, int],
        environ: dict[str, str],
        find_master: FindMaster,
    ) -> None:
        self._loop = Loop()
        self._requests = requests
        self._writer = MessageWriter(reports)
        self._screens = screens  # 1 or 2, by the descriptor to read from
        self._environ = environ
        self._find_master = find_master
        self._workplace: Workplace | None = None
        self._has_master = False
        self._decoder = msgspec.json.Decoder(protocol.Request)
        self._setup: AgentSetup | None = None
        self._output: RelayedOutput | None = None
        self._host: LocalHost | None = None
        self._timeout: LoopTimer | None = None
        self._ending = False

    def run(self) -> None:
        """Run until the launch, or the connection to it, ends."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            signal.signal(number, lambda *_: self._loop.post(self._end))
        self._writer.send(
            protocol.AgentVersion(protocol.PROTOCOL, rosz_version(), socket.gethostname())
        )
        self._loop.watch(self._requests.fd, self._read_requests)
        self._watch_screens()
        self._restart_timeout()
        try:
            self._loop.run()
        finally:
            if self._setup is not None:
                ProcessTree(self._setup.tag).kill()
            if self._output is not None:
                self._output.close()
            for fd, sink in self._screens.items():
                self._show(fd, sink)
            self._writer.close(_CLOSE_TIMEOUT)
            self._loop.close()

    def _read_requests(self) -> None:
        for line in self._requests.read():
            self._handle(self._decoder.decode(line))
        if self._requests.ended:
            self._end()
        else:
            self._restart_timeout()

    def _restart_timeout(self) -> None:
        """End when no further message arrives in time."""
        if self._timeout is not None:
            self._timeout.cancel()
        seconds = self._setup.silence if self._setup else _SETUP_TIMEOUT
        self._timeout = self._loop.later(seconds, self._end)

    def _watch_screens(self) -> None:
        for fd, sink in self._screens.items():
            self._loop.unwatch(fd)
            self._loop.watch(fd, partial(self._show, fd, sink))

    def _show(self, fd: int, sink: int) -> None:
        """Send output of nodes to the launch, and pause if too much of it waits."""
        with suppress(BlockingIOError):
            data = os.read(fd, 65536)
            self._writer.send(protocol.Shown(sink, data))
        if self._writer.full:
            for other in self._screens:
                self._loop.unwatch(other)
            self._writer.when_free(lambda: self._loop.post(self._watch_screens))

    def _handle(self, request: protocol.Request) -> None:
        if isinstance(request, AgentSetup):
            self._set_up(request)
            return
        host = self._host
        assert host is not None  # noqa: S101  # a launch sends `AgentSetup` first
        if isinstance(request, protocol.Start):
            self._start(host, request)
        elif isinstance(request, protocol.Signal):
            host.send(request)
        elif isinstance(request, protocol.Measure):
            host.measure(lambda used: self._writer.send(protocol.Measured(used)))
        elif isinstance(request, protocol.ReadOutput):
            number = request.number
            host.read_output(
                request.owner,
                request.after,
                lambda excerpt: self._writer.send(protocol.OutputRead(number, excerpt)),
            )

    def _set_up(self, setup: AgentSetup) -> None:
        self._setup = setup
        self._environ["ROS_DOMAIN_ID"] = str(setup.domain)
        environment = Environment.read(self._environ)
        reaches = _own_connection(environment)
        if not reaches:
            reaches = _find_launch(setup, self._environ.get("SSH_CONNECTION", ""))
            if reaches:
                self._environ["ROSZ_CONNECT"] = reaches
                environment = Environment.read(self._environ)
        self._output = RelayedOutput(
            self._loop, lambda text: self._writer.send(protocol.AgentWarning(text)), setup.tag
        )
        self._workplace = Workplace(
            package_index(environment), environment, self._environ, str(Path.cwd())
        )
        self._host = LocalHost(
            self._loop,
            self._output,
            self._workplace,
            folder=self._make_folder(RunFolder(environment.log_dir, setup.run_id)),
            tag=setup.tag,
            prefixed=setup.prefixed,
        )
        self._host.report = self._report
        self._writer.send(protocol.Ready(reaches))

    def _make_folder(self, folder: RunFolder) -> RunFolder | None:
        try:
            folder.create()
        except LaunchError as error:
            self._writer.send(protocol.AgentWarning(f"WARNING: {error}; continuing without logs"))
            return None
        return folder

    def _start(self, host: LocalHost, request: protocol.Start) -> None:
        try:
            self._give_master(request.job.node)
        except RoszError as error:
            self._writer.send(protocol.Refused(request.serial, str(error)))
        else:
            host.send(request)

    def _give_master(self, node: NodePlan) -> None:
        """Have a master of ROS 1 here before the first node starts that may need it."""
        workplace = self._workplace
        if workplace is None or self._has_master or not workplace.may_need_master(node):
            return
        whose, variables = self._find_master(self._environ, workplace.environment)
        self._environ.update(variables)  # the workplace has it, too
        self._has_master = True
        uri = variables["ROS_MASTER_URI"]
        self._writer.send(
            protocol.AgentWarning(f"nodes not in Python have {whose} ROS 1 master {uri}")
        )

    def _report(self, report: protocol.ProcessReport) -> None:
        self._writer.send(report)
        if self._ending and self._host is not None and self._host.is_idle:
            self._loop.stop()

    def _end(self) -> None:
        """End all processes, then the loop; a second call has no effect."""
        if self._ending:
            return
        self._ending = True
        self._loop.unwatch(self._requests.fd)
        host = self._host
        if self._setup is None or host is None or host.is_idle:
            self._loop.stop()
            return
        timeouts = self._setup.timeouts
        host.signal_all(signal.SIGINT)
        self._loop.later(timeouts.sigint, lambda: host.signal_all(signal.SIGTERM))
        self._loop.later(timeouts.sigint + timeouts.sigterm, self._loop.stop)


def _own_connection(environment: Environment) -> str:
    """Return where nodes connect by the settings of this machine; "" if these say nothing."""
    if environment.connect:
        return ",".join(environment.connect)
    if environment.multicast:
        return "peers found by multicast"
    if environment.listen or environment.zenoh_config:
        return "peers named in the settings of this machine"
    return environment.rendezvous if is_listening(environment.rendezvous) else ""


def _find_launch(setup: AgentSetup, connection: str) -> str:
    """Return where nodes here reach the launch; "" if they do not.

    ``SSH_CONNECTION`` begins with the address of the launch.
    """
    caller = connection.partition(" ")[0]
    caller = f"[{caller}]" if ":" in caller else caller
    meet = [
        place.replace("/:", f"/{caller}:") for place in setup.meet if caller or "/:" not in place
    ]
    return first_listening(meet, _CONNECT_TIMEOUT) if meet else ""


def serve(find_master: FindMaster) -> None:
    """Run the agent of the launch at the other end of standard input and output."""
    requests, reports = os.dup(0), os.dup(1)
    screens = {}
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    for sink in (1, 2):
        # The agent's own errors still go to the standard error of ssh.
        if sink == 2:  # noqa: PLR2004
            sys.stderr = os.fdopen(os.dup(2), "w", buffering=1)
        ours, theirs = os.pipe()
        os.set_blocking(ours, False)
        os.dup2(theirs, sink)
        os.close(theirs)
        screens[ours] = sink
    _Agent(LineReader(requests), reports, screens, dict(os.environ), find_master).run()
