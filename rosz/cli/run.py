"""``rosz run``: replace this process by an executable of a package, as rosrun does.

With ``--with``, by a container that runs several Python nodes.
"""

from __future__ import annotations

import errno
import os
import shlex
import sys
from pathlib import Path
from typing import Annotated, NoReturn

from rosz.cli import suggest
from rosz.cli.console import print_error
from rosz.cli.declare import App, Argument, Option
from rosz.errors import LaunchError, UsageError

app = App()


# Options behind the package belong to the program.
@app.command(interspersed=False)
def run_command(
    package: Annotated[str, Argument("PACKAGE", source=suggest.packages)] = "",
    executable: Annotated[
        str, Argument("EXECUTABLE", "An executable of the package.", suggest.executables)
    ] = "",
    arguments: Annotated[
        list[str] | None,
        Argument(
            "ARGS",
            "Arguments of the program, such as name:=value, _param:=value, __name:=value.",
            suggest.files,
        ),
    ] = None,
    *,
    prefix: Annotated[
        str, Option("--prefix -p COMMAND", "Run the program with a command, such as 'gdb --args'.")
    ] = "",
    others: Annotated[
        list[str] | None,
        Option(
            "--with COMMAND",
            "Run another Python node in the same process: 'PACKAGE EXECUTABLE [ARGS]' in quotes."
            " May be given several times.",
        ),
    ] = None,
    by_reference: Annotated[
        bool,
        Option(
            "--by-reference",
            "With --with: let nodes of rospy pass on messages themselves rather than copies.",
        ),
    ] = False,
    debug: Annotated[bool, Option("--debug -d", "Print the command line of the program.")] = False,
) -> None:
    """Run an executable of a package.

    A Python script runs under the interpreter of rosz, with the ROS 1 names importable.
    With --with, several run in one process (rosz help containers).
    """
    from rosz.environment import Environment, package_index
    from rosz.launch.run import Workplace, container_of
    from rosz.launch.run import run_command as make_command

    if not package:
        raise UsageError("no package is given: rosz run PACKAGE EXECUTABLE [ARGS]")
    environ = dict(os.environ)
    environment = Environment.read(environ)
    packages = package_index(environment)
    if not executable:
        listing = ", ".join(packages.find(package).executables()) or "it has none"
        raise UsageError(f"no executable of package '{package}' is given: {listing}")
    workplace = Workplace(packages, environment, environ, str(Path.cwd()))
    if others:
        if prefix:
            raise UsageError("--prefix is for one program, and --with runs several in one process")
        first = shlex.join([package, executable, *(arguments or [])])
        chosen = container_of(workplace, [first, *others], by_reference=by_reference)
    elif by_reference:
        raise UsageError("--by-reference does nothing without --with")
    else:
        chosen = make_command(workplace, package, executable, arguments or [], prefix)
    if debug:
        print_error(f"[rosz run] {' '.join(chosen.argv)}")
    if not chosen.python:
        _look_for_master(Path(chosen.argv[len(shlex.split(prefix))]), chosen.environ)
    _replace_process(chosen.argv, chosen.environ)


def _look_for_master(program: Path, environ: dict[str, str]) -> None:
    """Warn if a compiled program of ROS 1 has no master: it would wait for one."""
    from rosz.bridges.ros1 import MASTER_PORT, running_master

    uri = environ.get("ROS_MASTER_URI") or f"http://localhost:{MASTER_PORT}"
    try:
        is_ros1 = b"libroscpp.so" in program.read_bytes()
    except OSError:  # it may be executable and not readable
        return
    if is_ros1 and not running_master({"ROS_MASTER_URI": uri}):
        print_error(
            f"WARNING: '{program}' needs a ROS 1 master, and none answers at {uri}: start"
            " 'rosz core --ros1' on that machine, or use 'rosz launch', which brings one"
            " (rosz help cpp)"
        )


def _replace_process(argv: tuple[str, ...], environ: dict[str, str]) -> NoReturn:
    sys.stdout.flush()
    sys.stderr.flush()
    try:
        os.execvpe(argv[0], argv, environ)  # noqa: S606  # the purpose of the command
    except OSError as error:
        hint = ""
        if error.errno == errno.ENOEXEC:
            hint = "; if it is a script, its first line must name what runs it, as '#!/bin/sh' does"
        elif error.errno == errno.ENOENT:
            there = Path(argv[0]).is_file()
            hint = f"; is {'what its first line names' if there else 'it'} installed?"
        raise LaunchError(f"cannot run '{argv[0]}': {error.strerror}{hint}") from error
