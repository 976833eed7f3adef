"""``rosz launch``: roslaunch's command line, and control of running launches."""

from __future__ import annotations

import itertools
import os
import re
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any
from urllib.parse import urlsplit

import msgspec
from msgspec import Struct

from rosz.cli import suggest
from rosz.cli.console import print_error, print_json, print_lines
from rosz.cli.declare import App, Argument, Option, seconds
from rosz.environment import Environment, package_index
from rosz.errors import LaunchError, NotFoundError, TransportError, UsageError
from rosz.names import anonymous
from rosz.packages import PackageIndex, manifest_of

if TYPE_CHECKING:
    from rosz.launch.plan import LaunchText, Plan
    from rosz.launch.run import LaunchStatus, NodeStatus, Options, StatusClient, Workplace
    from rosz.node import Context

app = App()

_ROS1 = rb"<node\b[^>]*\stype=|\$\((arg|find|optenv)\s|<(machine|rosparam|test)\b|\swait_for="
_ROS2 = rb"<(node|executable)\b[^>]*\s(exec|cmd)=|\$\((var|find-pkg-share)\s"
_QUESTIONS = ("nodes", "args", "find_node", "files", "ros_args", "dump_params", "dump_plan")
_REQUESTS = ("status", "restart", "stop", "output")
_LISTED = 8
_WAIT_PERIOD = 0.1
_SAMPLE_SECONDS = 0.4
"""Time between the two measurements of processor time that give a share."""


class LaunchOptions(Struct, frozen=True, kw_only=True):
    """The options of ``rosz launch``."""

    screen: Annotated[bool, Option("--screen", "Show the output of all nodes.")] = False
    log: Annotated[bool, Option("--log", "Write the output of all nodes to files.")] = False
    required: Annotated[bool, Option("--required", "End the launch when any node ends.")] = False
    wait: Annotated[bool, Option("--wait", "Wait until a core or another launch runs.")] = False
    local: Annotated[bool, Option("--local", "Leave out nodes of other machines.")] = False
    prefix: Annotated[bool, Option("--prefix", "Begin each line with its node's name.")] = False
    verbose: Annotated[bool, Option("-v", "Print more.")] = False
    no_summary: Annotated[bool, Option("--no-summary", "Do not print what will start.")] = False
    disable_title: Annotated[
        bool, Option("--disable-title", "Do not change the title of the terminal.")
    ] = False
    sigint_timeout: Annotated[
        float,
        Option("--sigint-timeout SECONDS", "Time from SIGINT to SIGTERM when nodes are stopped."),
    ] = 15.0
    sigterm_timeout: Annotated[
        float, Option("--sigterm-timeout SECONDS", "Time from SIGTERM to SIGKILL.")
    ] = 2.0
    keys: Annotated[str, Option("--keys DIR", "Folder of keys for links to other machines.")] = ""
    pid: Annotated[
        str, Option("--pid FILE", "Write the process id of the launch to a file.", suggest.files)
    ] = ""
    nodes: Annotated[bool, Option("--nodes", "List the nodes.")] = False
    args: Annotated[str | None, Option("--args NODE", "Print the command line of a node.")] = None
    find_node: Annotated[
        str | None, Option("--find-node NODE", "Print the file that declares a node.")
    ] = None
    files: Annotated[bool, Option("--files", "List the files.")] = False
    ros_args: Annotated[bool, Option("--ros-args", "List the args that the file takes.")] = False
    dump_params: Annotated[bool, Option("--dump-params", "Print all parameters as YAML.")] = False
    dump_plan: Annotated[bool, Option("--dump-plan", "Print the whole plan as JSON.")] = False
    status: Annotated[bool, Option("--status", "List the nodes of running launches.")] = False
    restart: Annotated[
        str | None, Option("--restart NODE", "Restart a node of a running launch.", suggest.nodes)
    ] = None
    stop: Annotated[
        str | None, Option("--stop NODE", "Stop a node of a running launch.", suggest.nodes)
    ] = None
    output: Annotated[
        str | None,
        Option(
            "--output NODE", "Print the newest output of a node of a running launch.", suggest.nodes
        ),
    ] = None
    json: Annotated[bool, Option("--json", "Print JSON, with --status.")] = False
    machine: Annotated[
        list[str] | None,
        Option(
            "--machine [NAME=][USER@]ADDRESS[:PORT]",
            "Address of a machine of the file; without NAME, of the machine for nodes that"
            " name none.",
        ),
    ] = None
    lost_after: Annotated[
        float,
        Option("--lost-after SECONDS", "Time without a sign of another machine until it is lost."),
    ] = 30.0
    agent: Annotated[bool, Option("--agent")] = False
    skip_log_check: Annotated[bool, Option("--skip-log-check")] = True
    """roslaunch's scripts pass it; rosz has no such check."""
    port: Annotated[str, Option("--port -p")] = ""
    core: Annotated[bool, Option("--core")] = False


@app.command()
def launch_command(
    options: LaunchOptions,
    words: Annotated[
        list[str] | None,
        Argument(
            "FILE|ARG:=VALUE",
            "Launch files: PACKAGE FILE, or paths; '-' is standard input. ARG:=VALUE sets an"
            " arg of the files.",
            suggest.launch_words,
        ),
    ] = None,
) -> int:
    """Start the nodes of launch files, and run until they end.

    Without options it does what roslaunch does. Python nodes in a <group container="NAME"> share a
    process (rosz help containers).
    """
    if options.core or options.port:
        raise UsageError(
            "there is no master, and so no port: 'rosz core' runs a meeting point, ROS_DOMAIN_ID"
            " keeps groups of nodes apart"
        )
    if options.agent:
        from rosz.launch.run import serve

        with ExitStack() as stack:
            serve(partial(_find_master, stack))
        return 0
    questions, requests = _given(options, _QUESTIONS), _given(options, _REQUESTS)
    if requests:
        if words or len(requests) > 1:
            raise UsageError(
                "--status, --restart, --stop and --output stand alone: one of them, and no file"
            )
        _request(*requests[0], as_json=options.json)
        return 0
    if len(questions) > 1:
        listing = ", ".join(f"--{name}" for name, _ in questions)
        raise UsageError(f"{listing}: only one of them can be answered at a time")
    keys = Path(options.keys).expanduser().absolute() if options.keys else None
    launch = _Launch(words or (), keys)
    if questions:
        print_lines([launch.answer(*questions[0])])
        return 0
    settings = _settings(options)
    if options.pid:
        Path(options.pid).expanduser().write_text(str(os.getpid()))
    return launch.run(settings, wait=options.wait)


def _given(options: LaunchOptions, names: Sequence[str]) -> list[tuple[str, str]]:
    """Return those of some options that are given, each with its node."""
    values = {name.replace("_", "-"): getattr(options, name) for name in names}
    for option, node in values.items():
        if node == "":  # a script's empty variable must not start a launch
            raise UsageError(f"--{option} is ''; expected the name of a node")
    return [(option, str(node)) for option, node in values.items() if node]


def _settings(options: LaunchOptions) -> Options:
    from rosz.launch.run import MachineOption, Options, Timeouts

    return Options(
        screen=options.screen,
        log=options.log,
        required=options.required,
        local=options.local,
        prefixed=options.prefix,
        verbose=options.verbose,
        overview=not options.no_summary,
        title=not options.disable_title,
        machines=tuple(map(MachineOption.parse, options.machine or ())),
        silence=seconds("--lost-after", options.lost_after),
        timeouts=Timeouts(
            seconds("--sigint-timeout", options.sigint_timeout),
            seconds("--sigterm-timeout", options.sigterm_timeout),
        ),
    )


class _Launch:
    """The files, arguments and settings of one ``rosz launch`` command line."""

    def __init__(self, words: Sequence[str], keys: Path | None) -> None:
        from rosz.launch.plan import SystemContext, parse_arguments

        self.environ = dict(os.environ)
        if keys is not None:
            self.environ["ROSZ_KEYS"] = str(keys)
        self.cwd = Path.cwd()
        self.environment = Environment.read(self.environ, self.cwd)
        self.packages = package_index(self.environment)
        self.arguments = parse_arguments(words)
        for warning in self.arguments.warnings:
            print_error(f"WARNING: {warning}")
        self.files = _find_files(self.arguments.rest, self.packages)
        self._add_own_packages()
        self.context = SystemContext(self.packages, self.environ, self.cwd, _anonymous_names())

    def _add_own_packages(self) -> None:
        """Add the packages that the files are in to the package path, if they are not on it."""
        roots = self.environment.package_roots
        for file in self.files:
            folders = Path(file).absolute().parents if isinstance(file, str) else ()
            own = next((folder for folder in folders if manifest_of(folder) is not None), None)
            if own is not None and not any(own.is_relative_to(root) for root in roots):
                roots = (*roots, own)
        if roots != self.environment.package_roots:
            os.environ["ROSZ_PACKAGE_PATH"] = os.pathsep.join(map(str, roots))  # for Python files
            self.environment = msgspec.structs.replace(self.environment, package_roots=roots)
            self.packages = package_index(self.environment)

    @property
    def namespace(self) -> str:
        return self.arguments.ns or self.environment.namespace

    def plan(self) -> Plan:
        reader = reader_of(self.files)
        plan: Plan = reader.plan(self.files, self.arguments.args, self.context, ns=self.namespace)
        return plan

    def workplace(self) -> Workplace:
        """Return the packages and settings from which the commands of nodes are made."""
        from rosz.launch.run import Workplace

        return Workplace(self.packages, self.environment, self.environ, str(self.cwd))

    def answer(self, question: str, node: str) -> str:
        from rosz.launch.run import report

        if question == "ros-args":
            read = reader_of(self.files).describe_args
            args = self.arguments.args
            return report.describe(read(self.files, args, self.context, ns=self.namespace))
        plan = self.plan()
        ns = self.namespace or "/"
        if question == "args":
            find = self.workplace().find
            return report.node_args(plan, node, find, self.environ, ns=ns)
        if question == "find-node":
            return report.node_file(plan, node, ns=ns)
        if question == "dump-plan":
            return msgspec.json.format(plan.to_json()).decode()
        listings = {"nodes": report.list_nodes, "files": report.list_files}
        return listings.get(question, report.dump_params)(plan)

    def run(self, options: Options, *, wait: bool) -> int:
        from rosz.launch.run import (
            Network,
            RouterProcess,
            Runner,
            interrupted_by_signals,
            needs_router,
        )
        from rosz.node import Context

        plan = self.plan()
        with ExitStack() as stack:
            router: RouterProcess | None = None
            if needs_router(len(plan.nodes), self.environment, self.environ):
                stack.enter_context(interrupted_by_signals())
                router = stack.enter_context(RouterProcess(self.environment, self.environ))
                self.environment, self.environ = router.environment, router.environ
            with ExitStack() as masters, Context(self.environment) as context:
                if wait:
                    _wait_for_peer(context)
                self._open_master(plan, masters)
                network, place = Network(context, router), self.workplace()
                return Runner(plan, place, network, options, out=sys.stdout, err=sys.stderr).run()

    def _open_master(self, plan: Plan, stack: ExitStack) -> None:
        """Be the master of programs that may speak ROS 1's protocol.

        A master that the environment names and that is running stays theirs.
        """
        from rosz.launch.run import is_local

        place = self.workplace()
        local = [node for node in plan.nodes if is_local(plan.machine(node.machine))]
        programs = [node.name for node in local if place.may_need_master(node)]
        if not programs:
            return
        whose, self.environ = _find_master(stack, self.environ, self.environment)
        uri = self.environ["ROS_MASTER_URI"]
        shown = ", ".join([*programs[:_LISTED], *(["..."] if programs[_LISTED:] else [])])
        print_lines([f"nodes not in Python ({shown}) have {whose} ROS 1 master {uri}"])


def reader_of(files: Sequence[str | LaunchText]) -> Any:
    """Return the package that reads launch files into plans: that of ROS 1, or that of ROS 2."""
    if not any(isinstance(file, str) and _is_ros2(file) for file in files):
        return import_module("rosz.launch.plan")
    import_module("rosz.ros1")  # so that the files can import launch
    return import_module("rosz.ros2.launch")


def _is_ros2(file: str) -> bool:
    """Return whether a launch file is of ROS 2 by its name, or if in XML by its content."""
    if not file.endswith("launch.xml"):
        return file.endswith((".py", ".yaml", ".yml"))
    text = Path(file).read_bytes()
    return re.search(_ROS2, text) is not None and re.search(_ROS1, text) is None


def _find_master(
    stack: ExitStack, environ: Mapping[str, str], environment: Environment
) -> tuple[str, dict[str, str]]:
    """Return a master for ROS 1's programs, as its owner and their environment variables.

    It is the one that the variables name, if it runs, or a new one that the stack closes. The new
    one is at the port that they name for this machine, if that is free: other terminals use it.
    """
    from rosz.bridges.ros1 import MASTER_PORT, MasterBridge, open_master, running_master

    if running_master(environ):
        return "running", dict(environ)
    port = _local_port(environ.get("ROS_MASTER_URI", "")) or MASTER_PORT
    try:
        bridge = MasterBridge(environment, port=port)
    except TransportError:
        bridge = open_master(environment)
    stack.enter_context(bridge)
    uri = f"http://127.0.0.1:{bridge.port}"
    return "this launch's", {"ROS_IP": "127.0.0.1", **environ, "ROS_MASTER_URI": uri}


def _local_port(uri: str) -> int | None:
    """Return the port of a URI whose host is this machine; None for another or an invalid one."""
    from rosz.launch.run import is_local_address

    try:
        parts = urlsplit(uri)
        return parts.port if is_local_address(parts.hostname or "") else None
    except ValueError:
        return None


def _anonymous_names() -> Callable[[str], str]:
    """Return a function that makes unique names, also two within a millisecond."""
    numbers = itertools.count(1)

    def make(base: str) -> str:
        import socket

        moment = time.time_ns() // 1_000_000 + next(numbers)
        return anonymous(base, socket.gethostname(), os.getpid(), moment)

    return make


def _wait_for_peer(context: Context) -> None:
    if not context.session.peers():
        print_lines(["nobody else is there yet; waiting for a core or another launch"])
    while not context.session.peers():
        time.sleep(_WAIT_PERIOD)


def _find_files(words: Sequence[str], packages: PackageIndex) -> list[str | LaunchText]:
    """Return the launch files that a command line names.

    The words are a package and one of its files, then paths; or paths alone.

    Raises:
        UsageError: No file is named, or standard input is named twice.
        NotFoundError: A file does not exist.
    """
    if not words:
        raise UsageError("no launch file is given: rosz launch PACKAGE FILE, or rosz launch PATH")
    if words.count("-") > 1:
        raise UsageError("'-' is given twice; standard input can be read only once")
    first, rest = _first_file(words, packages)
    for word in rest:
        if word != "-" and not Path(word).is_file():
            raise NotFoundError(f"launch file '{word}' is not there")
    from rosz.launch.plan import LaunchText

    return [LaunchText(sys.stdin.buffer.read()) if word == "-" else word for word in (first, *rest)]


def _first_file(words: Sequence[str], packages: PackageIndex) -> tuple[str, Sequence[str]]:
    """Return the first launch file, and the words that follow it."""
    name = words[0]
    is_file = name == "-" or Path(name).is_file()
    if len(words) > 1 and "/" not in name and name != "-":
        try:
            return str(packages.find(name).file(words[1])), words[2:]
        except NotFoundError:
            if not is_file:
                raise
    if is_file:
        return name, words[1:]
    if Path(name).is_dir() and ("/" in name or name not in packages.names()):
        raise NotFoundError(f"'{name}' is a folder; name a launch file in it")
    raise NotFoundError(f"launch file '{name}' is not there{_hint(name, packages)}")


def _hint(name: str, packages: PackageIndex) -> str:
    """Return the place of a file of that name, or another meaning of the word."""
    if "/" in name:
        return ""
    if Path("launch", name).is_file():
        return f"; did you mean 'launch/{name}'?"
    if name in packages.names():
        own = sorted({file.name for file in packages.find(name).path.rglob("*.launch*")})
        if not own:
            return f"; '{name}' is a package, and has no launch files"
        which = f", such as {', '.join(own[:_LISTED])}"
        return f"; '{name}' is a package: name one of its launch files as well{which}"
    holders = [
        package.name
        for package in packages.packages()
        if (package.path / "launch" / name).is_file()
    ]
    if holders:
        return f"; package '{holders[0]}' has it: rosz launch {holders[0]} {name}"
    return "; give its path, or a package and a file: rosz launch PACKAGE FILE"


def _request(action: str, node: str, *, as_json: bool) -> None:
    """Print the status of running launches, or act on one of their nodes."""
    from rosz.introspect import command_config
    from rosz.launch.run import StatusClient
    from rosz.session import Session

    environment = Environment.read()
    try:
        session = Session.open(command_config(environment))
    except TransportError as error:
        raise LaunchError(
            f"no launch is running: nobody answers at {environment.rendezvous}"
        ) from error
    with session:
        client = StatusClient(session, environment.domain)
        if action in {"restart", "stop"}:
            client.request("restart" if action == "restart" else "stop", node)
        elif action == "output":
            sys.stdout.write("".join(excerpt.text for excerpt in client.newest_output(node)))
        else:
            _print_status(client, environment.domain, as_json=as_json)


def _print_status(client: StatusClient, domain: int, *, as_json: bool) -> None:
    before = client.running()
    if not before:
        raise LaunchError(f"no launch is running in domain {domain}")
    if as_json:
        print_json(list(before.values()))
        return
    time.sleep(_SAMPLE_SECONDS)
    for key, launch in client.running().items():
        sys.stdout.write(_table(launch, before.get(key, launch)))


def _table(launch: LaunchStatus, before: LaunchStatus) -> str:
    head = ("NODE", "STATE", "PID", "RESTARTS", "CPU", "MEMORY", "UPTIME", "MACHINE")
    earlier = {node.name: node.cpu for node in before.nodes}
    seconds = launch.sampled - before.sampled
    rows: list[tuple[str, ...]] = [head]
    for node in launch.nodes:
        rows.append(_row(node, earlier.get(node.name, node.cpu), seconds))
        rows += [(f"  {member}", f"in {node.name}", *"------") for member in node.members]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
    title = f"{', '.join(launch.files)} (launch {launch.pid} on {launch.host}, run {launch.run_id})"
    return "\n".join([title, *(f"  {line}" for line in lines), ""])


def _row(node: NodeStatus, cpu_before: float, seconds: float) -> tuple[str, ...]:
    share = f"{100 * max(0.0, node.cpu - cpu_before) / seconds:.0f} %" if seconds > 0 else "-"
    running = bool(node.pid)
    return (
        node.name,
        f"{node.state}: {node.detail}" if node.detail else node.state,
        str(node.pid or "-"),
        str(node.restarts),
        share if running else "-",
        f"{node.memory / 1e6:.0f} MB" if running else "-",
        _duration(node.uptime) if running else "-",
        node.machine or "-",
    )


def _duration(seconds: float) -> str:
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
