"""``rosz run``: run an executable of a package, in place of this process, as rosrun does."""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path
from typing import Annotated, NoReturn

from rosz.cli.declare import App, Argument, Option
from rosz.errors import LaunchError, UsageError

__all__ = ("app",)

app = App()


# What follows the package belongs to the program, options included.
@app.command(interspersed=False)
def command(
    words: Annotated[
        list[str] | None,
        Argument(
            metavar="PACKAGE EXECUTABLE [ARGS]...",
            help="What to run, and what to pass to it: name:=value, _param:=value, __name:=value …",
        ),
    ] = None,
    *,
    prefix: Annotated[
        str,
        Option(
            "--prefix",
            "-p",
            metavar="COMMAND",
            help="Put a command before it, such as 'gdb --args'.",
        ),
    ] = "",
    debug: Annotated[bool, Option("--debug", "-d", help="Print what is run.")] = False,
) -> None:
    """Run an executable of a package.

    A Python script runs under the interpreter of rosz, with the ROS 1 names importable.
    """
    from rosz.environment import Environment, package_index
    from rosz.launch.run.command import Workplace, run_command

    if not words:
        raise UsageError("no package is given: rosz run PACKAGE EXECUTABLE [ARGS]")
    package, *rest = words
    environ = dict(os.environ)
    environment = Environment.read(environ)
    packages = package_index(environment)
    if not rest:
        listing = ", ".join(packages.find(package).executables()) or "it has none"
        raise UsageError(f"no executable of package '{package}' is given: {listing}")
    workplace = Workplace(packages, environment, environ, str(Path.cwd()))
    chosen = run_command(workplace, package, rest[0], rest[1:], prefix)
    if debug:
        sys.stderr.write(f"[rosz run] {' '.join(chosen.argv)}\n")
    _become(chosen.argv, chosen.environ)


def _become(argv: tuple[str, ...], environ: dict[str, str]) -> NoReturn:
    sys.stdout.flush()
    sys.stderr.flush()
    try:
        os.execvpe(argv[0], argv, environ)  # noqa: S606  # that is what was asked for
    except OSError as error:
        hint = ""
        if error.errno == errno.ENOEXEC:
            hint = "; if it is a script, its first line must name what runs it, as '#!/bin/sh' does"
        elif error.errno == errno.ENOENT:
            there = Path(argv[0]).is_file()
            hint = f"; is {'what its first line names' if there else 'it'} installed?"
        raise LaunchError(f"cannot run '{argv[0]}': {error.strerror}{hint}") from error
