"""``rosz launch``: roslaunch's command line, and questions to running launches."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

from rosz.cli.bounds import seconds
from rosz.cli.declare import App, Argument, Option
from rosz.errors import UsageError

__all__ = ("app",)

app = App()


@app.command()
def command(
    words: Annotated[
        list[str] | None,
        Argument(
            metavar="[PACKAGE] FILE... [ARG:=VALUE...]",
            help="Launch files: one of a package, or paths; '-' reads one from standard input.",
        ),
    ] = None,
    *,
    screen: Annotated[bool, Option("--screen", help="All nodes write to the screen.")] = False,
    log: Annotated[bool, Option("--log", help="No node writes to the screen.")] = False,
    required: Annotated[
        bool, Option("--required", help="The launch ends when any node ends.")
    ] = False,
    wait: Annotated[
        bool, Option("--wait", help="Wait until a core or another launch is there.")
    ] = False,
    local: Annotated[bool, Option("--local", help="Leave out nodes of other machines.")] = False,
    prefix: Annotated[
        bool, Option("--prefix", help="Begin each line with the name of its node.")
    ] = False,
    verbose: Annotated[bool, Option("-v", help="Say more.")] = False,
    no_summary: Annotated[
        bool, Option("--no-summary", help="Do not print what will be done.")
    ] = False,
    disable_title: Annotated[
        bool, Option("--disable-title", help="Leave the title of the terminal.")
    ] = False,
    sigint_timeout: Annotated[
        float, Option(metavar="SECONDS", help="From SIGINT to SIGTERM, when ending nodes.")
    ] = 15.0,
    sigterm_timeout: Annotated[
        float, Option(metavar="SECONDS", help="From SIGTERM to SIGKILL.")
    ] = 2.0,
    keys: Annotated[
        str, Option(metavar="DIR", help="Keys that links beyond this machine need.")
    ] = "",
    pid: Annotated[
        str, Option(metavar="FILE", help="Write the process id of the launch to a file.")
    ] = "",
    nodes: Annotated[bool, Option("--nodes", help="List the nodes.")] = False,
    args: Annotated[str | None, Option(metavar="NODE", help="Print what starts a node.")] = None,
    find_node: Annotated[
        str | None, Option(metavar="NODE", help="Print the file that a node is in.")
    ] = None,
    files: Annotated[bool, Option("--files", help="List the files.")] = False,
    ros_args: Annotated[
        bool, Option("--ros-args", help="List the args that the file takes.")
    ] = False,
    dump_params: Annotated[
        bool, Option("--dump-params", help="Print all parameters as YAML.")
    ] = False,
    dump_plan: Annotated[
        bool, Option("--dump-plan", help="Print all that would be done as JSON.")
    ] = False,
    status: Annotated[bool, Option("--status", help="List the nodes of running launches.")] = False,
    restart: Annotated[
        str | None, Option(metavar="NODE", help="Have a running launch restart a node.")
    ] = None,
    stop: Annotated[
        str | None, Option(metavar="NODE", help="Have a running launch end a node.")
    ] = None,
    json: Annotated[bool, Option("--json", help="With --status: as JSON.")] = False,
    machine: Annotated[
        list[str] | None,
        Option(
            metavar="[NAME=][USER@]ADDRESS[:PORT]",
            help="Where a machine of the file is; without NAME, where nodes run that name none.",
        ),
    ] = None,
    lost_after: Annotated[
        float,
        Option(metavar="SECONDS", help="Without a word from another machine: it is lost."),
    ] = 30.0,
    agent: Annotated[bool, Option("--agent", hidden=True)] = False,
    skip_log_check: Annotated[bool, Option("--skip-log-check", hidden=True)] = True,
    port: Annotated[str, Option("--port", "-p", hidden=True)] = "",
    core: Annotated[bool, Option("--core", hidden=True)] = False,
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
    _check_named(args=args, find_node=find_node, restart=restart, stop=stop)
    if status or restart or stop:
        from rosz.cli.launch_control import control

        return control(
            words or (), status=status, restart=restart or "", stop=stop or "", as_json=json
        )
    question = _question(
        nodes=nodes,
        args=args,
        find_node=find_node,
        files=files,
        ros_args=ros_args,
        dump_params=dump_params,
        dump_plan=dump_plan,
    )
    from rosz.cli.launch_job import Job

    job = Job(words or (), Path(keys).expanduser().absolute() if keys else None)
    if question is not None:
        sys.stdout.write(job.answer(*question))
        return 0
    from rosz.launch.run import MachineOption, Options, Timeouts

    options = Options(
        screen=screen,
        log=log,
        required=required,
        local=local,
        prefixed=prefix,
        verbose=verbose,
        overview=not no_summary,
        title=not disable_title,
        machines=tuple(map(MachineOption.parse, machine or ())),
        silence=seconds("--lost-after", lost_after),
        timeouts=Timeouts(
            seconds("--sigint-timeout", sigint_timeout),
            seconds("--sigterm-timeout", sigterm_timeout),
        ),
    )
    if pid:
        Path(pid).expanduser().write_text(str(os.getpid()))
    return job.run(options, wait=wait)


def _check_named(**nodes: str | None) -> None:
    """See that options for a node name one: a script's empty variable must not start a launch."""
    for option, node in nodes.items():
        if node == "":
            raise UsageError(f"--{option.replace('_', '-')} is ''; expected the name of a node")


def _question(**asked: str | bool | None) -> tuple[str, str] | None:
    """Return which of roslaunch's questions is asked, and about which node."""
    chosen = [(name, str(value)) for name, value in asked.items() if value]
    if len(chosen) > 1:
        options = ", ".join(f"--{name.replace('_', '-')}" for name, _ in chosen)
        raise UsageError(f"{options}: only one of them can be answered at a time")
    return chosen[0] if chosen else None
