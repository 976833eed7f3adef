"""Run a plan: parameters first, then processes, until all have ended."""

from __future__ import annotations

import os
import re
import secrets
import socket
import uuid
from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import Any, TextIO

import msgspec

from rosz.errors import LaunchError, ParamNotFound, UsageError
from rosz.launch.plan import NodePlan, Plan
from rosz.launch.run.command import Workplace
from rosz.launch.run.console import Console, LaunchLog
from rosz.launch.run.containers import group_nodes
from rosz.launch.run.control import StatusServer
from rosz.launch.run.host import Host, LocalHost, is_local
from rosz.launch.run.loop import Loop, stopped_by_signals
from rosz.launch.run.machines import MachineOption, launch_endpoints, move_machines
from rosz.launch.run.network import RUN_ID, Network, core_params, launch_uri, set_params
from rosz.launch.run.output import RelayedOutput, RunFolder
from rosz.launch.run.process_tree import TAG, ProcessTree
from rosz.launch.run.protocol import AgentSetup, Timeouts
from rosz.launch.run.remote import Machines
from rosz.launch.run.supervisor import LaunchProcess, Supervisor
from rosz.lifecycle import Closable
from rosz.session import Session
from rosz.wire import entity_key

_RUN_ID_PATTERN = re.compile(r"[A-Za-z0-9][A-Za-z0-9-]{0,63}")
_MAX_VALUE_WIDTH = 20
_CLOCK_TIMEOUT = 5.0
"""Time in seconds from the start of the nodes until a silent ``/clock`` is reported."""


class Options(msgspec.Struct, frozen=True, kw_only=True):
    """The options of a launch.

    Attributes:
        screen: Whether all nodes write to the screen.
        log: Whether no node writes its standard output to the screen.
        required: Whether all nodes are required.
        local: Whether nodes of other machines are left out.
        prefixed: Whether lines on the screen begin with the name of their node.
        verbose: Whether the command line of each process is printed.
        overview: Whether the plan is printed first.
        title: Whether the terminal's window is named after the launch.
        machines: Addresses of machines, in place of those in the files.
        silence: Time in seconds without a message from another machine after which it counts as
            lost, and its agent ends the processes there.
        timeouts: Time that processes have to end.
        stay: Whether the launch goes on when all processes have ended, since more may come.
    """

    screen: bool = False
    log: bool = False
    required: bool = False
    local: bool = False
    prefixed: bool = False
    verbose: bool = False
    overview: bool = True
    title: bool = True
    machines: tuple[MachineOption, ...] = ()
    silence: float = 30.0
    timeouts: Timeouts = Timeouts()
    stay: bool = False


def apply_options(plan: Plan, options: Options) -> Plan:
    """Return the plan changed by the options that affect nodes.

    Raises:
        UsageError: If all nodes are to be required and one respawns, or a machine is unknown.
    """
    plan = move_machines(plan, options.machines)
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
        begun: Function called with the supervisor once the processes have been started.

    Raises:
        UsageError: If the options do not fit the plan.
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
        begun: Callable[[Supervisor], None] | None = None,
    ) -> None:
        self._begun = begun
        self._plan = apply_options(plan, options)
        self._workplace = workplace
        self._network = network
        self._options = options
        color = workplace.environment.color
        self._console = Console(out, err, verbose=options.verbose, color=color)
        self._processes: tuple[NodePlan, ...] = ()
        self._loop = Loop()
        self._machines = Machines(self._loop, self._console)
        self._stop: Callable[[], None] = self._loop.stop
        own = secrets.token_hex(8)
        # A launch within a node of another one carries its tag, so that the outer launch can still
        # find everything that this one starts.
        outer = workplace.environ.get(TAG)
        self._tag = f"{outer}:{own}" if outer else own
        self.run_id = ""

    def stop(self) -> None:
        """End the launch; safe from any thread."""
        self._loop.post(self._end)

    def _end(self) -> None:
        self._stop()  # which `_supervise` replaces

    def run(self) -> int:
        """Run until the end.

        Returns:
            The exit code: 1 if a node could not be started, or a required one failed; otherwise 0.

        Raises:
            LaunchError: If the launch cannot run.
            ParamError: If a value is not a parameter value.
        """
        output = RelayedOutput(self._loop, self._console.error, self._tag)
        try:
            supervisor = self._prepare(output)
            self._supervise(supervisor)
            output.close()
            self._console.say("shutting down processing monitor...")
            self._console.say("... shutting down processing monitor complete")
            if supervisor.failures:
                self._console.error(describe_failures(supervisor.failures))
            self._console.strong("done")
        finally:
            self._machines.close()
            output.close()
            self._loop.close()
            self._console.close()
        return 1 if supervisor.failed else 0

    def _prepare(self, output: RelayedOutput) -> Supervisor:
        console, network = self._console, self._network
        is_new_run = self._find_run()
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
        hosts = self._connect_machines(local)
        if network.router is not None:
            console.say("auto-starting new core")
            console.strong(f"process[core]: started with pid [{network.router.pid}]")
            network.router.keep_running(self._loop, console)
        if is_new_run:
            console.strong(f"setting {RUN_ID} to {self.run_id}")
        extra = core_params(self.run_id) if is_new_run else {}
        set_params(self._plan, network, console, {**extra, **launch_uri(os.getpid())})
        return self._make_supervisor(hosts)

    def _find_run(self) -> bool:
        """Set the id of the run, and return whether the run is new."""
        try:
            run_id = self._network.get(RUN_ID)
        except ParamNotFound:
            run_id = None
        # Checked, as anybody may have set it, and it becomes part of paths and keys.
        if isinstance(run_id, str) and _RUN_ID_PATTERN.fullmatch(run_id):
            self.run_id = run_id
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
            self._console.error(f"WARNING: {error}; continuing without logs")
            return None
        self._console.say(f"... logging to {folder.path / name}")
        return folder

    def _introduce(self) -> None:
        plan, console = self._plan, self._console
        if self._options.title and self._workplace.environ.get("TERM") != "dumb":
            console.title(",".join(plan.files))
        if self._options.overview:
            machines = any(not is_local(machine) for machine in plan.machines)
            console.say(describe_plan(plan, machines=machines))
        self._processes = group_nodes(
            plan.nodes, self._workplace, lambda text: console.error(f"WARNING: {text}")
        )
        for notice in (*plan.warnings, *plan.deprecations):
            console.error(f"WARNING: {notice}")

    def _connect_machines(self, local: Host) -> Callable[[NodePlan], Host]:
        """Connect to other machines, and return a function from nodes to machines.

        Raises:
            LaunchError: If a machine cannot be used.
        """
        setup = AgentSetup(
            run_id=self.run_id,
            tag=self._tag,
            domain=self._workplace.environment.domain,
            meet=launch_endpoints(self._workplace.environment),
            silence=self._options.silence,
            timeouts=self._options.timeouts,
            prefixed=self._options.prefixed,
        )
        names = dict.fromkeys(node.machine for node in self._processes)
        others = {
            name: machine
            for name in names
            if (machine := self._plan.machine(name)) is not None and not is_local(machine)
        }
        hosts = self._machines.connect(others, setup)
        return lambda node: hosts.get(node.machine, local)

    def _make_supervisor(self, hosts: Callable[[NodePlan], Host]) -> Supervisor:
        alone = self._network.alone
        if not self._plan.nodes and not self._options.stay:
            self._console.strong("No processes to monitor")
            if alone:
                self._console.say("nobody else holds the parameters: staying until Ctrl-C")
        return Supervisor(
            self._processes,
            hosts,
            self._loop,
            self._console,
            steps=self._plan.steps,
            timeouts=self._options.timeouts,
            holds=self._network.holds,
            stay=self._options.stay or (alone and not self._plan.nodes),
        )

    def _supervise(self, supervisor: Supervisor) -> None:
        self._stop = supervisor.shutdown
        network, console = self._network, self._console
        server = network.session and StatusServer(
            network.session,
            network.domain,
            self.run_id,
            self._loop,
            supervisor,
            files=self._plan.files,
        )
        clock = network.session and self._watch_clock(network.session)
        with stopped_by_signals(self._loop, self.stop, supervisor.kill, console.dump_stacks):
            try:
                supervisor.start()
                if self._begun is not None:
                    self._begun(supervisor)
                self._loop.run()
            finally:
                if clock is not None:
                    clock.close()
                supervisor.kill()
                ProcessTree(self._tag).kill()
                if server is not None:
                    server.close()

    def _watch_clock(self, session: Session) -> Closable | None:
        """Warn once if nodes take their time from ``/clock`` and nobody publishes it."""
        if not self._network.is_simulated:
            return None

        def warn() -> None:
            clock.close()
            self._console.error(
                f"WARNING: /use_sim_time is set, and /clock is silent after {_CLOCK_TIMEOUT:g} s:"
                " until it ticks, the time of nodes stands still; start the simulator or player, or"
                " set /use_sim_time to false and start the nodes again"
            )

        def heard() -> None:
            timer.cancel()
            clock.close()

        timer = self._loop.later(_CLOCK_TIMEOUT, warn)
        key = entity_key(self._network.domain, "/clock", "*", "*")
        clock = session.subscriber(key, lambda _: self._loop.post(heard))
        return clock


def describe_plan(plan: Plan, *, machines: bool = False) -> str:
    """Return a summary of a plan as roslaunch prints it, with its machines if wanted."""
    parts = ["\nSUMMARY\n========"]
    if plan.clear:
        cleared = sorted(f" * {name.rstrip('/')}/" for name in plan.clear)
        parts.append("CLEAR PARAMETERS\n" + "\n".join(cleared))
    if plan.params:
        lines = sorted(f" * {param.name}: {_shorten(param.value)}" for param in plan.params)
        parts.append("PARAMETERS\n" + "\n".join(lines))
    if machines:
        parts.append("MACHINES\n" + "\n".join(sorted(f" * {m.name}" for m in plan.machines)))
    parts.append("NODES\n" + "\n".join(_list_nodes(plan.nodes)))
    return "\n\n".join(parts) + "\n"


def _list_nodes(nodes: Iterable[NodePlan]) -> list[str]:
    by_namespace: defaultdict[str, list[str]] = defaultdict(list)
    for node in nodes:
        what = f"{node.package}/{node.type}" if node.package else " ".join(node.command)
        by_namespace[f"{node.namespace.rstrip('/')}/"].append(f"    {node.name} ({what})")
    return [line for ns in sorted(by_namespace) for line in (f"  {ns}", *sorted(by_namespace[ns]))]


def _shorten(value: Any) -> str:
    """Return a value in at most 20 printable characters."""
    text = str(value)
    if len(text) > _MAX_VALUE_WIDTH:
        text = text[: _MAX_VALUE_WIDTH - 3] + "..."
    stripped = text.rstrip()
    if all(" " <= char <= "~" for char in stripped):
        return stripped if stripped != text and not text.isprintable() else text
    return "<...>"


def describe_failures(processes: Iterable[LaunchProcess]) -> str:
    """Return which processes failed or died, why, and their last output."""
    parts = []
    for process in processes:
        lines = [f" * {process.node.full_name} [{process.label}] {process.describe_end()}"]
        lines += [f"     {line}" for line in process.tail]
        parts.append("\n".join(lines))
    return "\n".join(["\nDIED", *parts])
