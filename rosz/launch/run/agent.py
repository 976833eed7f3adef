"""The far side of a launch: started by ssh, spoken to over its pipes, and by nobody else.

It starts and ends processes as the launch itself does on its own machine, and keeps their logs
here. It ends, and they with it, when the launch says so by closing the pipe, when the launch or
the link dies, and when nothing was heard for too long.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path

import msgspec

from rosz.environment import Environment, package_index
from rosz.errors import LaunchError, RoszError
from rosz.launch.run.command import Workplace
from rosz.launch.run.family import kill_family, usage
from rosz.launch.run.folder import RunFolder
from rosz.launch.run.host import Child, LocalHost
from rosz.launch.run.loop import Loop, Timer
from rosz.launch.run.output import Output
from rosz.launch.run.pipe import Lines, Outbox
from rosz.launch.run.protocol import (
    PROTOCOL,
    Exited,
    Gone,
    Hello,
    Measure,
    Measured,
    Notice,
    Ready,
    Refused,
    Request,
    Setup,
    Shown,
    Signal,
    Start,
    Started,
    rosz_version,
)
from rosz.session import first_listening, is_listening

__all__ = ("serve",)

_LOOK_SECONDS = 0.02
_SETUP_SECONDS = 60.0
_REACH_SECONDS = 1.0
_FLUSH_SECONDS = 1.0


class Agent:
    """The processes of one launch on this machine.

    Args:
        requests: Where the launch's words come from.
        answers: Where ours go.
        screens: What the nodes' output comes from, by the descriptor that they write to.
        environ: Variables of this process.
    """

    def __init__(
        self, requests: Lines, answers: int, screens: Mapping[int, int], environ: dict[str, str]
    ) -> None:
        self._loop = Loop()
        self._requests = requests
        self._outbox = Outbox(answers, lambda: self._loop.post(self._listen))
        self._screens = screens
        self._environ = environ
        self._decoder = msgspec.json.Decoder(Request)
        self._setup: Setup | None = None
        self._output: Output | None = None
        self._host: LocalHost | None = None
        self._children: dict[int, Child] = {}
        self._patience: Timer | None = None
        self._ending = False

    def run(self) -> None:
        """Work until the launch, or the link to it, ends."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            signal.signal(number, lambda *_: self._loop.post(self._end))
        self._outbox.send(Hello(PROTOCOL, rosz_version(), socket.gethostname()))
        self._loop.watch(self._requests.fd, self._heard)
        self._listen()
        self._expect()
        try:
            self._loop.run()
        finally:
            if self._setup is not None:
                kill_family(self._setup.tag)
            if self._output is not None:
                self._output.close()
            for fd, sink in self._screens.items():
                self._show(fd, sink)
            self._outbox.close(_FLUSH_SECONDS)
            self._loop.close()

    def _heard(self) -> None:
        for line in self._requests.read():
            self._obey(self._decoder.decode(line))
        if self._requests.ended:
            self._end()
        else:
            self._expect()

    def _expect(self) -> None:
        """End when nothing more is heard for too long."""
        if self._patience is not None:
            self._patience.cancel()
        seconds = self._setup.silence if self._setup else _SETUP_SECONDS
        self._patience = self._loop.later(seconds, self._end)

    def _listen(self) -> None:
        """Pass on what nodes write to the screen, unless too much of it waits already."""
        for fd, sink in self._screens.items():
            self._loop.unwatch(fd)
            self._loop.watch(fd, partial(self._show, fd, sink))

    def _show(self, fd: int, sink: int) -> None:
        with suppress(BlockingIOError):
            data = os.read(fd, 65536)
            self._outbox.send(Shown(sink, data))
        if self._outbox.full:
            for other in self._screens:
                self._loop.unwatch(other)

    def _obey(self, request: Request) -> None:
        if isinstance(request, Setup):
            self._set_up(request)
        elif isinstance(request, Start):
            self._start(request)
        elif isinstance(request, Signal):
            child = self._children.get(request.serial)
            if child is not None:
                child.signal(request.number)
        elif isinstance(request, Measure):
            self._measure()

    def _set_up(self, setup: Setup) -> None:
        self._setup = setup
        self._environ["ROS_DOMAIN_ID"] = str(setup.domain)
        environment = Environment.read(self._environ)
        reaches = _reaches(environment, setup, self._environ.get("SSH_CONNECTION", ""))
        if reaches and not _is_linked(environment):
            self._environ["ROSZ_CONNECT"] = reaches
            environment = Environment.read(self._environ)
        folder: RunFolder | None = RunFolder(environment.log_dir, setup.run_id)
        try:
            assert folder is not None  # noqa: S101  # for the type checker
            folder.create()
        except LaunchError as error:
            self._outbox.send(Notice(f"WARNING: {error}; going on without logs"))
            folder = None
        self._output = Output(self._loop, lambda text: self._outbox.send(Notice(text)))
        workplace = Workplace(
            package_index(environment), environment, self._environ, str(Path.cwd())
        )
        self._host = LocalHost(
            self._loop,
            self._output,
            workplace,
            folder=folder,
            tag=setup.tag,
            prefixed=setup.prefixed,
        )
        self._outbox.send(Ready(reaches))

    def _start(self, request: Start) -> None:
        assert self._host is not None  # noqa: S101  # a launch says `Setup` first
        serial = request.serial

        def ended(code: int, tail: tuple[str, ...]) -> None:
            self._outbox.send(Exited(serial, code, tail))
            self._look(serial)

        try:
            child = self._host.start(request.job, ended)
        except RoszError as error:
            self._outbox.send(Refused(serial, str(error)))
            return
        self._children[serial] = child
        self._outbox.send(Started(serial, child.pid, child.shown, child.logs))

    def _look(self, serial: int) -> None:
        """Tell when nothing of a process is left."""
        child = self._children[serial]
        if child.remains():
            self._loop.later(_LOOK_SECONDS, partial(self._look, serial))
            return
        del self._children[serial]
        self._outbox.send(Gone(serial))
        if self._ending and not self._children:
            self._loop.stop()

    def _measure(self) -> None:
        assert self._setup is not None  # noqa: S101  # a launch says `Setup` first
        tag = self._setup.tag
        used = {
            mark.removeprefix(f"{tag}:").partition(":")[0]: total
            for mark, total in usage(tag).items()
        }
        self._outbox.send(
            Measured({int(owner): total for owner, total in used.items() if owner.isdigit()})
        )

    def _end(self) -> None:
        """End all processes, then the loop; again is no error."""
        if self._ending:
            return
        self._ending = True
        self._loop.unwatch(self._requests.fd)
        if self._setup is None or not self._children:
            self._loop.stop()
            return
        timeouts = self._setup.timeouts
        self._signal(signal.SIGINT)
        self._loop.later(timeouts.sigint, lambda: self._signal(signal.SIGTERM))
        self._loop.later(timeouts.sigint + timeouts.sigterm, self._loop.stop)

    def _signal(self, number: signal.Signals) -> None:
        for child in self._children.values():
            child.signal(number)


def _is_linked(environment: Environment) -> bool:
    """Tell whether this machine has its own way to others."""
    return bool(
        environment.connect
        or environment.listen
        or environment.multicast
        or environment.zenoh_config
        or is_listening(environment.rendezvous)
    )


def _reaches(environment: Environment, setup: Setup, connection: str) -> str:
    """Return what nodes here link to: what this machine is set to, or else where the launch is.

    Args:
        environment: Settings of this machine.
        setup: Has the places where the launch may be.
        connection: ``SSH_CONNECTION``, which begins with the address that the launch calls from.
    """
    if environment.connect:
        return ",".join(environment.connect)
    if environment.multicast:
        return "whom multicast finds"
    if environment.listen or environment.zenoh_config:
        return "whom this machine's settings name"
    if is_listening(environment.rendezvous):
        return environment.rendezvous
    caller = connection.partition(" ")[0]
    caller = f"[{caller}]" if ":" in caller else caller
    meet = [
        place.replace("/:", f"/{caller}:") for place in setup.meet if caller or "/:" not in place
    ]
    return first_listening(meet, _REACH_SECONDS) if meet else ""


def serve() -> None:
    """Be the agent of the launch at the other end of standard input and output."""
    requests, answers = os.dup(0), os.dup(1)
    screens = {}
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    for sink in (1, 2):
        # What is left of the agent itself on standard error is for whoever reads ssh's.
        if sink == 2:  # noqa: PLR2004
            sys.stderr = os.fdopen(os.dup(2), "w", buffering=1)
        ours, theirs = os.pipe()
        os.set_blocking(ours, False)
        os.dup2(theirs, sink)
        os.close(theirs)
        screens[ours] = sink
    Agent(Lines(requests), answers, screens, dict(os.environ)).run()
