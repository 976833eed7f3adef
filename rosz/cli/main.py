"""Entry of the ``rosz`` command: finds the group, imports only that, and turns errors into lines.

Data goes to stdout, talk to stderr. Exit code 0, 1 (it failed), 2 (wrong usage), 130 (Ctrl-C).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module

from rosz.errors import RoszError, UsageError, near_miss

__all__ = ("COMMANDS", "main", "run")

COMMANDS = {
    "launch": "start the nodes of a launch file",
    "run": "run an executable of a package",
    "core": "hold the meeting point and a replica of the parameters, until stopped",
    "param": "get and set parameters",
    "reconfigure": "read and change settings of nodes while they run",
    "topic": "list, show, measure and publish topics",
    "service": "list and call services",
    "node": "list, inspect, ping and end nodes",
    "msg": "show message types",
    "srv": "show service types",
    "gen": "write Python modules for the messages of a package",
    "pkg": "list, find, create and check packages",
    "log": "follow the log of all nodes, set levels",
    "keys": "make and check the keys that links between machines need",
    "doctor": "name what is wrong, what shows it and what to do",
    "turtlesim": "take pictures of turtlesims",
    "env": "print what to eval in a shell",
}
_INTERRUPTED = 130


def main() -> None:
    """Run the command line of this process, and exit with its code."""
    code = run(sys.argv[1:])
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _forget_stdout()
    sys.exit(code)


def run(argv: Sequence[str]) -> int:
    """Run one command line.

    Args:
        argv: Arguments without the program name.

    Returns:
        The exit code; every error that is ours, or the system's, has been printed as one line.
    """
    try:
        return _dispatch(list(argv))
    except UsageError as error:
        return _fail(error, 2)
    except RoszError as error:
        return _fail(error, 1)
    except BrokenPipeError:
        _forget_stdout()
        return 0
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        return _fail(f"{place}{error.strerror or error}", 1)
    except KeyboardInterrupt:
        return _INTERRUPTED


def _dispatch(argv: list[str]) -> int:
    if not argv or argv[0] in {"-h", "--help", "help"}:
        sys.stdout.write(_overview())
        return 0 if argv else 2
    if argv[0] in {"-V", "--version", "version"}:
        from importlib.metadata import version

        sys.stdout.write(f"rosz {version('rosz')}\n")
        return 0
    name = argv[0]
    if name == "complete":
        from rosz.cli.complete import complete

        return complete(argv[1:])
    if name not in COMMANDS:
        hint = near_miss(name, COMMANDS) or "; 'rosz --help' lists them"
        raise UsageError(f"'{name}' is no command{hint}")
    module = import_module(f"rosz.cli.{name}")
    return _invoke(module.app, argv[1:], f"rosz {name}")


def _invoke(app: object, argv: list[str], program: str) -> int:
    """Run a typer app without letting it exit the process or print tracebacks."""
    import typer
    from typer.exceptions import TyperException

    from rosz.cli.light import make_light

    assert isinstance(app, typer.Typer)  # noqa: S101  # every group module defines one
    make_light(app)
    if not argv and app.info.no_args_is_help is True:
        app(args=["--help"], prog_name=program, standalone_mode=False)
        return 2
    try:
        code = app(args=argv, prog_name=program, standalone_mode=False)
    except typer.Abort:
        return _INTERRUPTED
    except SystemExit as error:
        # The only case in which typer does so here: nobody reads the output any more.
        raise BrokenPipeError from error
    except TyperException as error:
        format_message = getattr(error, "format_message", error.__str__)
        text = f"{format_message().rstrip('.')}; see '{program} --help'"
        return _fail(text, getattr(error, "exit_code", 2))
    return code if isinstance(code, int) else 0


def _overview() -> str:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:<{width}}  {text}" for name, text in COMMANDS.items()]
    return "\n".join(
        ["usage: rosz COMMAND [ARGUMENTS]", "", *lines, "", "rosz COMMAND --help tells more.", ""]
    )


def _fail(what: object, code: int) -> int:
    sys.stderr.write(f"rosz: {what}\n")
    return code


def _forget_stdout() -> None:
    """Keep the interpreter from complaining, at its end, that nobody reads its output."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
