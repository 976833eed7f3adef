"""``rosz launch``: roslaunch's command line, and questions to running launches."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from rosz.environment import Environment, package_index
from rosz.errors import NotFoundError, UsageError

if TYPE_CHECKING:
    from rosz.launch.plan import LaunchText, Plan
    from rosz.launch.run import Hub, Options, Workplace
    from rosz.node.context import Context
    from rosz.packages import PackageIndex

__all__ = ("app", "launch")

app = typer.Typer(add_completion=False)

_LISTED = 8
_LOOK_SECONDS = 0.1


def launch(argv: Sequence[str]) -> int:
    """Run ``rosz launch`` with these arguments, and return its exit code.

    Raises:
        RoszError: It failed; `UsageError` for wrong usage.
    """
    code = app(args=list(argv), prog_name="rosz launch", standalone_mode=False)
    return code if isinstance(code, int) else 0


@app.command()
def command(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[PACKAGE] FILE... [ARG:=VALUE...]",
            help="Launch files: one of a package, or paths; '-' reads one from standard input.",
        ),
    ] = None,
    *,
    screen: Annotated[
        bool, typer.Option("--screen", help="All nodes write to the screen.")
    ] = False,
    log: Annotated[bool, typer.Option("--log", help="No node writes to the screen.")] = False,
    required: Annotated[
        bool, typer.Option("--required", help="The launch ends when any node ends.")
    ] = False,
    wait: Annotated[
        bool, typer.Option("--wait", help="Wait until a core or another launch is there.")
    ] = False,
    local: Annotated[
        bool, typer.Option("--local", help="Leave out nodes of other machines.")
    ] = False,
    prefix: Annotated[
        bool, typer.Option("--prefix", help="Begin each line with the name of its node.")
    ] = False,
    verbose: Annotated[bool, typer.Option("-v", help="Say more.")] = False,
    no_summary: Annotated[
        bool, typer.Option("--no-summary", help="Do not print what will be done.")
    ] = False,
    disable_title: Annotated[
        bool, typer.Option("--disable-title", help="Leave the title of the terminal.")
    ] = False,
    sigint_timeout: Annotated[
        float, typer.Option(metavar="SECONDS", help="From SIGINT to SIGTERM, when ending nodes.")
    ] = 15.0,
    sigterm_timeout: Annotated[
        float, typer.Option(metavar="SECONDS", help="From SIGTERM to SIGKILL.")
    ] = 2.0,
    keys: Annotated[
        str, typer.Option(metavar="DIR", help="Keys that links beyond this machine need.")
    ] = "",
    pid: Annotated[
        str, typer.Option(metavar="FILE", help="Write the process id of the launch to a file.")
    ] = "",
    nodes: Annotated[bool, typer.Option("--nodes", help="List the nodes.")] = False,
    args: Annotated[str, typer.Option(metavar="NODE", help="Print what starts a node.")] = "",
    find_node: Annotated[
        str, typer.Option(metavar="NODE", help="Print the file that a node is in.")
    ] = "",
    files: Annotated[bool, typer.Option("--files", help="List the files.")] = False,
    ros_args: Annotated[
        bool, typer.Option("--ros-args", help="List the args that the file takes.")
    ] = False,
    dump_params: Annotated[
        bool, typer.Option("--dump-params", help="Print all parameters as YAML.")
    ] = False,
    dump_plan: Annotated[
        bool, typer.Option("--dump-plan", help="Print all that would be done as JSON.")
    ] = False,
    status: Annotated[
        bool, typer.Option("--status", help="List the nodes of running launches.")
    ] = False,
    restart: Annotated[
        str, typer.Option(metavar="NODE", help="Have a running launch restart a node.")
    ] = "",
    stop: Annotated[
        str, typer.Option(metavar="NODE", help="Have a running launch end a node.")
    ] = "",
    json: Annotated[bool, typer.Option("--json", help="With --status: as JSON.")] = False,
    machine: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAME=][USER@]ADDRESS[:PORT]",
            help="Where a machine of the file is; without NAME, where nodes run that name none.",
        ),
    ] = None,
    lost_after: Annotated[
        float,
        typer.Option(metavar="SECONDS", help="Without a word from another machine: it is lost."),
    ] = 30.0,
    agent: Annotated[bool, typer.Option("--agent", hidden=True)] = False,
    skip_log_check: Annotated[bool, typer.Option("--skip-log-check", hidden=True)] = True,
    port: Annotated[str, typer.Option("--port", "-p", hidden=True)] = "",
    core: Annotated[bool, typer.Option("--core", hidden=True)] = False,
) -> int:
    """Start the nodes of a launch file, and watch them until the end.

    Without options it does what roslaunch does. 'name:=value' sets an arg of the file.
    """
    del skip_log_check  # roslaunch's scripts give it; rosz never spends time on that check
    if core or port:
        raise UsageError(
            "there is no master, and so no port: 'rosz core' keeps a meeting point, ROS_DOMAIN_ID"
            " keeps groups of nodes apart"
        )
    if agent:
        from rosz.launch.run.agent import serve

        serve()
        return 0
    if status or restart or stop:
        from rosz.cli.launch_control import control

        return control(words or (), status=status, restart=restart, stop=stop, as_json=json)
    question = _question(
        nodes=nodes,
        args=args,
        find_node=find_node,
        files=files,
        ros_args=ros_args,
        dump_params=dump_params,
        dump_plan=dump_plan,
    )
    job = _Job(words or (), Path(keys).expanduser().absolute() if keys else None)
    if question is not None:
        sys.stdout.write(job.answer(*question))
        return 0
    from rosz.launch.run import MachineCall, Options, Timeouts

    options = Options(
        screen=screen,
        log=log,
        required=required,
        local=local,
        prefixed=prefix,
        verbose=verbose,
        overview=not no_summary,
        title=not disable_title,
        machines=tuple(map(MachineCall.parse, machine or ())),
        silence=_positive("--lost-after", lost_after),
        timeouts=Timeouts(
            _positive("--sigint-timeout", sigint_timeout),
            _positive("--sigterm-timeout", sigterm_timeout),
        ),
    )
    if pid:
        Path(pid).expanduser().write_text(str(os.getpid()))
    return job.run(options, wait=wait)


def _question(**asked: str | bool) -> tuple[str, str] | None:
    """Return which of roslaunch's questions is asked, and about which node."""
    chosen = [(name, str(value)) for name, value in asked.items() if value]
    if len(chosen) > 1:
        options = ", ".join(f"--{name.replace('_', '-')}" for name, _ in chosen)
        raise UsageError(f"{options}: only one of them can be answered at a time")
    return chosen[0] if chosen else None


def _positive(option: str, seconds: float) -> float:
    if not seconds > 0:
        raise UsageError(f"{option} is {seconds:g}; expected a number of seconds above 0")
    return seconds


class _Job:
    """A command line, taken apart and looked up.

    Args:
        words: All that is no option.
        keys: Folder of the keys that it and its nodes use, in place of ``ROSZ_KEYS``.
    """

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
            sys.stderr.write(f"WARNING: {warning}\n")
        self.files = find_files(self.arguments.rest, self.packages)
        self._include_own_package()
        self.context = SystemContext(self.packages, self.environ, self.cwd, _Anonymous())

    def _include_own_package(self) -> None:
        """Have the package that a file lies in found, also where it is not on the path."""
        roots = self.environment.package_roots
        for file in self.files:
            folders = Path(file).absolute().parents if isinstance(file, str) else ()
            own = next((folder for folder in folders if (folder / "package.xml").is_file()), None)
            if own is not None and not any(own.is_relative_to(root) for root in roots):
                roots = (*roots, own)
        if roots != self.environment.package_roots:
            self.environment = msgspec.structs.replace(self.environment, package_roots=roots)
            self.packages = package_index(self.environment)

    @property
    def namespace(self) -> str:
        return self.arguments.ns or self.environment.namespace

    def plan(self) -> Plan:
        from rosz.launch.plan import plan

        return plan(self.files, self.arguments.args, self.context, ns=self.namespace)

    def workplace(self) -> Workplace:
        from rosz.launch.run import Workplace

        return Workplace(self.packages, self.environment, self.environ, str(self.cwd))

    def answer(self, question: str, node: str) -> str:
        """Return the answer to one of roslaunch's questions."""
        from rosz.launch.plan import describe_args, report

        if question == "ros_args":
            docs = describe_args(self.files, self.arguments.args, self.context, ns=self.namespace)
            return f"{report.describe(docs)}\n"
        plan = self.plan()
        ns = self.namespace or "/"
        if question == "args":
            find = self.workplace().find
            return f"{report.node_args(plan, node, find, self.environ, ns=ns)}\n"
        if question == "find_node":
            return f"{report.node_file(plan, node, ns=ns)}\n"
        if question == "dump_plan":
            return msgspec.json.format(plan.to_json()).decode() + "\n"
        plain = {"nodes": report.list_nodes, "files": report.list_files}
        return f"{plain.get(question, report.dump_params)(plan)}\n"

    def run(self, options: Options, *, wait: bool) -> int:
        """Carry the plan out."""
        from rosz.launch.run import Hub, wants_hub

        plan = self.plan()
        if not wants_hub(len(plan.nodes), self.environment, self.environ):
            return self._carry_out(plan, options, wait=wait)
        with Hub(self.environment, self.environ) as hub:
            self.environment, self.environ = hub.environment, hub.environ
            return self._carry_out(plan, options, wait=wait, hub=hub)

    def _carry_out(
        self, plan: Plan, options: Options, *, wait: bool, hub: Hub | None = None
    ) -> int:
        from rosz.launch.run import Network, Runner
        from rosz.node.context import Context

        with Context(self.environment) as context:
            if wait:
                _await_others(context)
            runner = Runner(
                plan,
                self.workplace(),
                Network.of(context, hub),
                options,
                out=sys.stdout,
                err=sys.stderr,
            )
            return runner.run()


class _Anonymous:
    """Makes names unique, also when asked twice within a millisecond."""

    def __init__(self) -> None:
        self._count = 0

    def __call__(self, base: str) -> str:
        import socket
        import time

        from rosz import names

        self._count += 1
        moment = time.time_ns() // 1_000_000 + self._count
        return names.anonymous(base, socket.gethostname(), os.getpid(), moment)


def _await_others(context: Context) -> None:
    if not context.session.peers():
        sys.stdout.write("nobody else is there yet; waiting for a core or another launch\n")
        sys.stdout.flush()
    while not context.session.peers():
        time.sleep(_LOOK_SECONDS)


def find_files(words: Sequence[str], packages: PackageIndex) -> list[str | LaunchText]:
    """Return the launch files that a command line names.

    Args:
        words: A package and a file of it, then paths; or paths alone; one of them may be ``-``.
        packages: Where packages are looked up.

    Raises:
        UsageError: No file is named, or standard input twice.
        NotFoundError: A file is not there.
    """
    if not words:
        raise UsageError("no launch file is given: rosz launch PACKAGE FILE, or rosz launch PATH")
    if words.count("-") > 1:
        raise UsageError("'-' is given twice; standard input can be read only once")
    first, rest = _first(words, packages)
    for word in rest:
        if word != "-" and not Path(word).is_file():
            raise NotFoundError(f"launch file '{word}' is not there")
    return [_read_stdin() if word == "-" else word for word in (first, *rest)]


def _first(words: Sequence[str], packages: PackageIndex) -> tuple[str, Sequence[str]]:
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
    if Path(name).is_dir() and "/" in name:
        raise NotFoundError(f"'{name}' is a folder; name a launch file in it")
    raise NotFoundError(f"launch file '{name}' is not there{_hint(name, packages)}")


def _hint(name: str, packages: PackageIndex) -> str:
    """Say where a file of that name is, or what else a lone word might have meant."""
    if "/" in name:
        return ""
    if Path("launch", name).is_file():
        return f"; did you mean 'launch/{name}'?"
    if name in packages.names():
        own = sorted(file.name for file in packages.find(name).path.glob("launch/*.launch"))
        which = f", such as {', '.join(own[:_LISTED])}" if own else ""
        return f"; '{name}' is a package: name one of its launch files as well{which}"
    holders = [
        package.name
        for package in packages.packages()
        if (package.path / "launch" / name).is_file()
    ]
    if holders:
        return f"; package '{holders[0]}' has it: rosz launch {holders[0]} {name}"
    return "; give its path, or a package and a file: rosz launch PACKAGE FILE"


def _read_stdin() -> LaunchText:
    from rosz.launch.plan import LaunchText

    return LaunchText(sys.stdin.buffer.read())
