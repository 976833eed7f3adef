"""Entry point of the ``rosz`` command: it imports one command, runs it and reports errors.

Data goes to standard output, everything else to standard error. The exit code is 0 for success, 1
for failure, 2 for wrong usage and 130 for Ctrl-C.
"""

from __future__ import annotations

import atexit
import gc
import io
import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, NoReturn

from rosz.cli.commands import COMMANDS, OLD_NAMES, format_rows, load
from rosz.cli.console import print_error
from rosz.errors import RoszError, UsageError, near_miss

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

    from rosz.cli.declare import App

_INTERRUPTED = 130
_GC_THRESHOLD = 10_000
"""New objects between two garbage collections: imports create many objects and no garbage."""


def main() -> None:
    """Run the command line of this process, and exit with its exit code."""
    gc.set_threshold(_GC_THRESHOLD)
    _replace_closed_streams()
    _name_stdout()
    code = run(sys.argv[1:])
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _discard_stdout()
    except OSError as error:
        _discard_stdout()
        code = code or _fail(_describe(error), 1)
    _exit(code)


def _replace_closed_streams() -> None:
    """Open a stream for every standard stream that the shell has closed (``>&-``).

    They are opened in the order of their numbers, so that no file and no connection gets the number
    of a standard stream.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115  # stays open; importing pathlib takes long


class _Stdout(io.FileIO):
    """Standard output; its errors name it."""

    def write(self, data: ReadableBuffer, /) -> int:
        try:
            return super().write(data)
        except OSError as error:
            error.filename = "cannot write to standard output"
            raise


def _name_stdout() -> None:
    """Replace standard output by a stream whose errors name it, wherever they are raised."""
    given = sys.stdout
    if not isinstance(given, io.TextIOWrapper) or given.closed or given.name != "<stdout>":
        return
    raw = _Stdout(given.fileno(), "w", closefd=False)
    raw.name = given.name
    sys.stdout = io.TextIOWrapper(
        raw if given.write_through else io.BufferedWriter(raw),  # unbuffered for python -u
        encoding=given.encoding,
        errors=given.errors,
        line_buffering=given.line_buffering,
        write_through=given.write_through,
    )


def _exit(code: int) -> NoReturn:
    """End the process without finalizing the interpreter, where that makes no difference.

    Finalizing takes longer than most commands, and the system frees everything anyway.
    """
    threading = sys.modules.get("threading")
    if threading is not None and not all(thread.daemon for thread in threading.enumerate()[1:]):
        sys.exit(code)  # this waits for the other threads
    atexit._run_exitfuncs()  # noqa: SLF001  # the only way to run them, as sys.exit does
    os._exit(code)


def run(argv: Sequence[str]) -> int:
    """Run one command line, print every error as one line, and return the exit code."""
    try:
        return _dispatch(list(argv))
    except RoszError as error:
        return _fail(error, 2 if isinstance(error, UsageError) else 1)
    except BrokenPipeError:
        _discard_stdout()
        return 0
    except OSError as error:
        return _fail(_describe(error), 1)
    except KeyboardInterrupt:
        return _INTERRUPTED


def _describe(error: OSError) -> str:
    """Return the text of an error of the system, with its place if known."""
    if error.filename:
        return f"{error.filename}: {error.strerror}"
    try:
        os.getcwd()  # noqa: PTH109  # importing pathlib takes long
    except FileNotFoundError:
        return "the working folder has been deleted: change to another one with 'cd'"
    return error.strerror or str(error)


def _dispatch(argv: list[str]) -> int:
    if argv[:1] == ["help"] and argv[1:2] and argv[1] in COMMANDS:
        from rosz.cli.system import pages

        if len(argv) > 2 or argv[1] not in pages():  # noqa: PLR2004  # a command of a group
            argv = [*argv[1:], "--help"]
    if not argv or argv[0] in {"-h", "--help"}:
        sys.stdout.write(_overview())
        return 0 if argv else 2
    name, *words = argv
    if name in {"-V", "--version", "version"}:
        sys.stdout.write(f"{_versions()}\n")
        return 0
    if name == "complete":
        from rosz.cli.complete import complete

        return complete(words)
    if name == "ros2":
        from rosz.cli.ros2 import main as run_ros2

        return run_ros2(words)
    if name in OLD_NAMES:
        return _invoke(load(OLD_NAMES[name]), words, name)
    if name not in COMMANDS:
        from rosz.replacements import instead_of

        instead = instead_of(name)
        hint = near_miss(name, COMMANDS) or "; 'rosz --help' lists them"
        raise UsageError(
            f"rosz has no '{name}': {instead}" if instead else f"'{name}' is not a command{hint}"
        )
    return _invoke(load(name), words, f"rosz {name}")


def _overview() -> str:
    return (
        "Usage: rosz COMMAND [ARGS]...\n\n"
        "Commands:\n"
        f"{format_rows(COMMANDS.items())}\n"
        "'rosz COMMAND --help' describes a command, 'rosz help' lists the pages of the manual.\n"
    )


def _invoke(app: App, argv: list[str], program: str) -> int:
    """Run a command line of an app, with typer unless it is simple; return the exit code."""
    from rosz.cli.reading import read

    alone = bool(app.help) and not argv
    command = None if alone else read(app, argv)
    if command is not None:
        return command() or 0
    from rosz.cli.typer_app import run as run_typer

    code = run_typer(app, ["--help"] if alone else argv, program)
    return 2 if alone else code or 0


def _versions() -> str:
    """Return the versions that a report of a fault needs: of rosz, Zenoh and Python."""
    import platform
    from importlib.metadata import PackageNotFoundError, version

    def of(package: str) -> str:
        try:
            return version(package)
        except PackageNotFoundError:
            return "of unknown version (not installed, but on the path)"

    python = platform.python_version()
    return f"rosz {of('rosz')}, Zenoh {of('eclipse-zenoh')}, Python {python}"


def _fail(what: object, code: int) -> int:
    print_error(f"ERROR: {what}")
    return code


def _discard_stdout() -> None:
    """Keep the interpreter from reporting, at its end, that nobody reads standard output."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
