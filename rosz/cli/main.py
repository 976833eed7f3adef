"""Entry of the ``rosz`` command: finds the group, imports only that, and turns errors into lines.

Data goes to stdout, talk to stderr. Exit code 0, 1 (it failed), 2 (wrong usage), 130 (Ctrl-C).
"""

from __future__ import annotations

import atexit
import gc
import io
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, NoReturn

from rosz.errors import RoszError, UsageError, near_miss

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

    from rosz.cli.declare import App

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
_GARBAGE = 10_000
"""New objects after which Python looks for rings of them: loading modules makes many, and none."""


def main() -> None:
    """Run the command line of this process, and exit with its code."""
    gc.set_threshold(_GARBAGE)
    _stand_in_for_closed_streams()
    _name_stdout()
    code = run(sys.argv[1:])
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _forget_stdout()
    except OSError as error:
        _forget_stdout()
        code = code or _fail(_of_system(error), 1)
    _leave(code)


def _stand_in_for_closed_streams() -> None:
    """Have somewhere to write to, and nothing to read, where the shell closed a stream (``>&-``).

    The three are opened in the order of their numbers, so that no file, and no connection, gets
    the number of one of them.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115  # for good, and pathlib takes long to load


class _Stdout(io.FileIO):
    """Standard output, whose errors tell where they come from."""

    def write(self, data: ReadableBuffer, /) -> int:
        try:
            return super().write(data)
        except OSError as error:
            error.filename = "cannot write to standard output"
            raise


def _name_stdout() -> None:
    """Have errors of standard output, at whatever write they come, told as such."""
    given = sys.stdout
    if not isinstance(given, io.TextIOWrapper) or given.closed or given.name != "<stdout>":
        return
    raw = _Stdout(given.fileno(), "w", closefd=False)
    raw.name = given.name
    sys.stdout = io.TextIOWrapper(
        raw if given.write_through else io.BufferedWriter(raw),  # as python -u has it
        encoding=given.encoding,
        errors=given.errors,
        line_buffering=given.line_buffering,
        write_through=given.write_through,
    )


def _leave(code: int) -> NoReturn:
    """End the process, without the interpreter's taking itself apart where nobody needs that.

    That takes longer than most commands, and frees what is freed with the process anyway.
    """
    threading = sys.modules.get("threading")
    if threading is not None and not all(one.daemon for one in threading.enumerate()[1:]):
        sys.exit(code)  # which waits for them
    atexit._run_exitfuncs()  # noqa: SLF001  # the only way to what sys.exit would run
    os._exit(code)


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
        return _fail(_of_system(error), 1)
    except KeyboardInterrupt:
        return _INTERRUPTED


def _of_system(error: OSError) -> str:
    """Return what to say of the system's refusal, which often tells no place."""
    if error.filename:
        return f"{error.filename}: {error.strerror}"
    try:
        os.getcwd()  # noqa: PTH109  # pathlib takes long to load
    except FileNotFoundError:
        return "the working folder has been deleted: change to another one with 'cd'"
    return error.strerror or str(error)


def _dispatch(argv: list[str]) -> int:
    if argv[:1] == ["help"]:
        argv = [*argv[1:], "--help"]
    if not argv or argv[0] in {"-h", "--help"}:
        from rosz.cli.help import overview

        sys.stdout.write(overview(COMMANDS))
        return 0 if argv else 2
    if argv[0] in {"-V", "--version", "version"}:
        sys.stdout.write(f"rosz {_version()}\n")
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


def _invoke(app: App, argv: list[str], program: str) -> int:
    """Run a command, or tell what there is, or have typer say why the line is none."""
    from rosz.cli.reading import read

    run_it = read(app, argv) if argv or not app.text else None
    if run_it is None:
        from rosz.cli.help import asked_for

        text = asked_for(app, argv, program)
        if text:
            sys.stdout.write(text)
            return 0 if argv else 2
    code = _ask_typer(app, argv, program) if run_it is None else run_it()
    return code if isinstance(code, int) else 0


def _ask_typer(app: App, argv: list[str], program: str) -> object:
    """Run a typer app without letting it exit the process or print tracebacks."""
    import typer
    from typer.exceptions import TyperException

    from rosz.cli.typed import to_typer

    context, words = app.sorted_out(argv)
    try:
        return to_typer(app, context)(args=words, prog_name=program, standalone_mode=False)
    except typer.Abort:
        return _INTERRUPTED
    except SystemExit as error:
        # The only case in which typer does so here: nobody reads the output any more.
        raise BrokenPipeError from error
    except TyperException as error:
        if app.text and words and words[0] in app.commands:
            program += f" {words[0]}"
        text = getattr(error, "format_message", error.__str__)()
        return _fail(_in_our_words(text, program), getattr(error, "exit_code", 2))


def _in_our_words(text: str, program: str) -> str:
    """Return what typer says of a line, as all else here is said."""
    text = text[:1].lower() + text[1:].rstrip(".").replace(". Did you mean", "; did you mean")
    if text.startswith("no such option: -") and text[-1:].isdigit():
        text += "; a negative value goes behind '--'"
    return text if text.endswith("?") else f"{text}; see '{program} --help'"


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("rosz")
    except PackageNotFoundError:
        return "of unknown version: it is not installed, but runs from its sources"


def _fail(what: object, code: int) -> int:
    sys.stderr.write(f"rosz: {what}\n")
    return code


def _forget_stdout() -> None:
    """Keep the interpreter from complaining, at its end, that nobody reads its output."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
