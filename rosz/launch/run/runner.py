"""Carrying a plan out: parameters first, then processes, until all of it is over."""

from __future__ import annotations

import os
import re
import secrets
import socket
import uuid
from collections.abc import Callable
from typing import TextIO

import msgspec

from rosz.errors import LaunchError, ParamNotFound, UsageError
from rosz.launch.plan.model import NodePlan, Plan
from rosz.launch.run import summary
from rosz.launch.run.command import TAG, Workplace
from rosz.launch.run.console import Console
from rosz.launch.run.control import Panel
from rosz.launch.run.family import kill_family
from rosz.launch.run.folder import LaunchLog, RunFolder
from rosz.launch.run.host import Host, LocalHost, is_local
from rosz.launch.run.loop import Loop
from rosz.launch.run.machines import MachineCall, Machines, meeting_places, moved
from rosz.launch.run.network import Network
from rosz.launch.run.output import Output
from rosz.launch.run.parameters import RUN_ID, carry_out, core_params, launch_uri
from rosz.launch.run.process import Timeouts
from rosz.launch.run.protocol import Setup
from rosz.launch.run.stopping import stopped_by_signals
from rosz.launch.run.supervisor import Supervisor

__all__ = ("Options", "Runner", "forced")

_RUN_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9-]{0,63}")


class Options(msgspec.Struct, frozen=True, kw_only=True):
    """How a plan is carried out.

    Attributes:
        screen: All nodes write to the screen.
        log: No node writes its standard output to the screen.
        required: All nodes are required.
        local: Nodes of other machines are left out.
        prefixed: Lines on the screen begin with the name of their node.
        verbose: The command line of each process is printed.
        overview: What the launch will do is printed first.
        title: The terminal's window is named after the launch.
        machines: Where machines are, against what the files say.
        silence: Seconds without a word from another machine after which it counts as lost, and
            ends what it runs.
        timeouts: How long processes may take to end.
    """

    screen: bool = False
    log: bool = False
    required: bool = False
    local: bool = False
    prefixed: bool = False
    verbose: bool = False
    overview: bool = True
    title: bool = True
    machines: tuple[MachineCall, ...] = ()
    silence: float = 30.0
    timeouts: Timeouts = Timeouts()


def forced(plan: Plan, options: Options) -> Plan:
    """Return the plan with what the options force upon all nodes.

    Raises:
        UsageError: All are to be required, and one is to respawn; or a machine is unknown.
    """
    plan = moved(plan, options.machines)
    nodes = plan.nodes
    if options.local:
        nodes = tuple(node for node in nodes if is_local(plan.machine(node.machine)))
    if options.screen or options.log:
        output = "log" if options.log else "screen"
        nodes = tuple(msgspec.structs.replace(node, output=output) for node in nodes)
    if options.required:
        for node in nodes:
            if node.respawn:
                raise UsageError(
                    f"{node.place}: node '{node.full_name}' has respawn=\"true\", so it cannot be"
                    " required; leave out --required"
                )
        nodes = tuple(msgspec.structs.replace(node, required=True) for node in nodes)
    return msgspec.structs.replace(plan, nodes=nodes)


class Runner:
    """One launch.

    Args:
        plan: What to run.
        workplace: Where from.
        network: Where to.
        options: How.
        out: Where it is said what goes well.
        err: Where it is said what does not.
    """

    def __init__(
        self,
        plan: Plan,
        workplace: Workplace,
        network: Network,
        options: Options,
        *,
        out: TextIO,
        err: TextIO,
    ) -> None:
        self._plan = forced(plan, options)
        self._workplace = workplace
        self._network = network
        self._options = options
        color = workplace.environment.color
        self._console = Console(out, err, verbose=options.verbose, color=color)
        self._loop = Loop()
        self._machines = Machines(self._loop, self._console)
        self._stop: Callable[[], None] = self._loop.stop
        own = secrets.token_hex(8)
        # Within a node of another launch, that one can still find all that this one starts.
        outer = workplace.environ.get(TAG)
        self._tag = f"{outer}:{own}" if outer else own
        self.run_id = ""

    def stop(self) -> None:
        """End the launch; from any thread."""
        self._loop.post(self._end)

    def _end(self) -> None:
        self._stop()

    def run(self) -> int:
        """Run until the end.

        Returns:
            The exit code: 1 when a node could not be started, or a required one failed; else 0.

        Raises:
            LaunchError: The launch cannot be carried out.
            ParamError: A parameter is not acceptable.
            UsageError: The options do not fit the plan.
        """
        output = Output(self._loop, self._console.error)
        try:
            supervisor = self._prepare(output)
            self._supervise(supervisor)
            output.close()
            self._conclude(supervisor)
        finally:
            self._machines.close()
            output.close()
            self._loop.close()
            self._console.close()
        return 1 if supervisor.failed else 0

    def _prepare(self, output: Output) -> Supervisor:
        """Do all that comes before the first process."""
        console, network = self._console, self._network
        fresh = self._find_run()
        folder = self._make_folder()
        self._introduce()
        local = LocalHost(
            self._loop,
            output,
            self._workplace,
            folder=folder,
            tag=self._tag,
            prefixed=self._options.prefixed,
        )
        hosts = self._hosts(local)
        if network.hub is not None:
            console.say("auto-starting new core")
            console.strong(f"process[core]: started with pid [{network.hub.pid}]")
            network.hub.keep(self._loop, console)
        if fresh:
            console.strong(f"setting {RUN_ID} to {self.run_id}")
        extra = core_params(self.run_id) if fresh else {}
        carry_out(self._plan, network.store, console, {**extra, **launch_uri(os.getpid())})
        return self._supervisor(hosts)

    def _find_run(self) -> bool:
        """Find out which run this is; tell whether it is a new one."""
        try:
            found = self._network.store.get(RUN_ID)
        except ParamNotFound:
            found = None
        # Anybody may have set it, and it becomes part of paths and keys.
        if isinstance(found, str) and _RUN_ID.fullmatch(found):
            self.run_id = found
            return False
        self.run_id = str(uuid.uuid1())
        return True

    def _make_folder(self) -> RunFolder | None:
        folder = RunFolder(self._workplace.environment.log_dir, self.run_id)
        name = f"roslaunch-{socket.gethostname()}-{os.getpid()}.log"
        try:
            folder.create()
            self._console.log = LaunchLog(folder.path / name)
        except (LaunchError, OSError) as error:
            self._console.error(f"WARNING: {error}; going on without logs")
            return None
        self._console.say(f"... logging to {folder.path / name}")
        return folder

    def _introduce(self) -> None:
        plan, console = self._plan, self._console
        if self._options.title and self._workplace.environ.get("TERM") != "dumb":
            console.title(",".join(plan.files))
        if self._options.overview:
            machines = any(not is_local(machine) for machine in plan.machines)
            console.say(summary.overview(plan, machines=machines))
        for notice in (*plan.warnings, *plan.deprecations):
            console.error(f"WARNING: {notice}")

    def _hosts(self, local: Host) -> Callable[[NodePlan], Host]:
        """Return what gives the machine of a node; other machines are called here.

        Raises:
            LaunchError: A machine cannot be used.
        """
        setup = Setup(
            run_id=self.run_id,
            tag=self._tag,
            domain=self._workplace.environment.domain,
            meet=meeting_places(self._workplace.environment),
            silence=self._options.silence,
            timeouts=self._options.timeouts,
            prefixed=self._options.prefixed,
        )
        wanted = dict.fromkeys(node.machine for node in self._plan.nodes)
        others = {
            name: machine
            for name in wanted
            if (machine := self._plan.machine(name)) is not None and not is_local(machine)
        }
        called = self._machines.call(others, setup)
        return lambda node: called.get(node.machine, local)

    def _supervisor(self, hosts: Callable[[NodePlan], Host]) -> Supervisor:
        alone = self._network.alone
        if not self._plan.nodes:
            self._console.strong("No processes to monitor")
            if alone:
                self._console.say("nobody else holds the parameters: staying until Ctrl-C")
        return Supervisor(
            self._plan.nodes,
            hosts,
            self._loop,
            self._console,
            timeouts=self._options.timeouts,
            readiness=self._network.readiness,
            stay=alone and not self._plan.nodes,
        )

    def _supervise(self, supervisor: Supervisor) -> None:
        self._stop = supervisor.shutdown
        network = self._network
        panel = network.session and Panel(
            network.session,
            network.domain,
            self.run_id,
            self._loop,
            supervisor,
            files=self._plan.files,
        )
        with stopped_by_signals(self._loop, self._console, self.stop, supervisor.kill):
            try:
                supervisor.start()
                self._loop.run()
            finally:
                supervisor.kill()
                kill_family(self._tag)
                if panel is not None:
                    panel.close()

    def _conclude(self, supervisor: Supervisor) -> None:
        console = self._console
        console.say("shutting down processing monitor...")
        console.say("... shutting down processing monitor complete")
        text = summary.fallen(supervisor.fallen)
        if text:
            console.error(text)
        console.strong("done")
