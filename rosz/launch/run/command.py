"""From a node of the plan, or the words of ``rosz run``, to what the system executes.

A Python script runs under the interpreter that runs rosz, with the ROS 1 names importable
(``python -m rosz.script SCRIPT``); any other program runs as it is.
"""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from rosz.environment import Environment
from rosz.errors import ExecutableNotFound
from rosz.launch.plan import report
from rosz.launch.plan.model import NodePlan
from rosz.packages import Package, PackageIndex

__all__ = ("TAG", "Command", "Workplace", "is_python", "run_command")

TAG = "ROSZ_LAUNCH"
"""Variable by which all descendants of a launched process are known again."""

_SHEBANG_BYTES = 256
_PYTHON = re.compile(r"python[0-9.]*")
_SCRIPT = ("-m", "rosz.script")


class Command(msgspec.Struct, frozen=True):
    """Something to execute.

    Attributes:
        argv: Program and arguments.
        shown: The same as messages show it: the script, not its interpreter.
        environ: All variables.
        cwd: Folder to start in.
        python: Whether it is a script run by rosz.
        direct: Whether it gets the terminal of the launch itself, as a debugger needs.
    """

    argv: tuple[str, ...]
    shown: tuple[str, ...]
    environ: dict[str, str]
    cwd: str
    python: bool = False
    direct: bool = False


class Workplace(msgspec.Struct, frozen=True):
    """What commands are made from, beside the plan.

    Attributes:
        packages: Where executables are looked up.
        environment: Settings of this process.
        environ: Variables of this process.
        cwd: Folder that the launch was started in.
    """

    packages: PackageIndex
    environment: Environment
    environ: Mapping[str, str]
    cwd: str

    def command(self, node: NodePlan, *, log_file: Path | None, tag: str) -> Command:
        """Return how to start a node.

        Args:
            node: The node.
            log_file: Where it is told to keep its log; None leaves that to the node.
            tag: Marks the process and its descendants.

        Raises:
            PackageNotFound: There is no such package.
            ExecutableNotFound: The package has no such executable.
        """
        environ = base_environ(self.environ, self.environment)
        environ.pop("ROS_NAMESPACE", None)
        environ |= report.environment(node) | {TAG: tag}
        direct = bool(node.launch_prefix) and node.output == "screen"
        if node.command:
            words = tuple(report.command_line(node, self.find))
            return Command(words, words, environ, self._cwd(node.cwd, None), direct=direct)
        shown = tuple(report.command_line(node, self.find))
        if log_file is not None:
            shown = (*shown, f"__log:={log_file}")
        prefixed = len(node.launch_prefix)
        program = Path(shown[prefixed])
        python = is_python(program)
        start = _start(node.launch_prefix, program, python=python)
        return Command(
            argv=(*start, *shown[prefixed + 1 :]),
            shown=shown,
            environ=environ,
            cwd=self._cwd(node.cwd, program),
            python=python,
            direct=direct,
        )

    def find(self, package: str, executable: str) -> str:
        """Return the path of an executable.

        Raises:
            PackageNotFound: There is no such package.
            ExecutableNotFound: The package has no such executable.
        """
        return str(locate(self.packages.find(package), executable))

    def _cwd(self, wish: str, program: Path | None) -> str:
        if wish.lower() == "node" and program is not None:
            return str(program.parent)
        if wish.lower() == "ros_home":
            return str(self.environment.home) if program is not None else self.cwd
        return str(Path(self.cwd, wish))


def run_command(
    workplace: Workplace, package: str, executable: str, args: Sequence[str], prefix: str = ""
) -> Command:
    """Return how ``rosz run`` starts a program: here and now, in place of this process.

    Args:
        workplace: Where to look.
        package: Name of the package.
        executable: Name of the file, or its path within the package.
        args: Arguments as given.
        prefix: What to put before it, split as a shell does.

    Raises:
        PackageNotFound: There is no such package.
        ExecutableNotFound: The package has no such executable.
    """
    program = locate(workplace.packages.find(package), executable)
    before = tuple(shlex.split(prefix))
    python = is_python(program)
    return Command(
        argv=(*_start(before, program, python=python), *args),
        shown=(*before, str(program), *args),
        environ=base_environ(workplace.environ, workplace.environment),
        cwd=workplace.cwd,
        python=python,
        direct=True,
    )


def base_environ(environ: Mapping[str, str], environment: Environment) -> dict[str, str]:
    """Return the variables of a child: ours, and where packages are, which its folder cannot tell.

    Args:
        environ: Variables of this process.
        environment: Settings of this process.
    """
    roots = os.pathsep.join(str(root) for root in environment.package_roots)
    return {**environ, "ROSZ_PACKAGE_PATH": roots} if roots else dict(environ)


def locate(package: Package, name: str) -> Path:
    """Return an executable by its name, or by its path within the package.

    Raises:
        ExecutableNotFound: It is not there, or may not be executed.
    """
    if "/" not in name:
        return package.executable(name)
    path = package.within(name)
    if path.is_file() and os.access(path, os.X_OK):
        return path
    if path.is_file():
        raise ExecutableNotFound(f"'{path}' is not executable; run: chmod +x {path}")
    raise ExecutableNotFound(
        f"package '{package.name}' has no file '{path}'; give the name of the executable alone to"
        " have it looked for"
    )


def is_python(program: Path) -> bool:
    """Tell whether a program is a Python script, by its suffix or its first line."""
    if program.suffix == ".py":
        return True
    try:
        with program.open("rb") as file:
            first = file.readline(_SHEBANG_BYTES)
    except OSError:  # it may be executed without being readable: then it is no script
        return False
    return first.startswith(b"#!") and b"python" in first


def _start(prefix: Sequence[str], program: Path, *, python: bool) -> tuple[str, ...]:
    """Return the words up to the program's own arguments."""
    if not python:
        return (*prefix, str(program))
    if prefix and _PYTHON.fullmatch(Path(prefix[0]).name):
        # "python3 -m pdb", "python -u": the interpreter is asked for by name, its options count.
        return (sys.executable, *prefix[1:], *_SCRIPT, str(program))
    # -P keeps modules that lie in the folder of the launch from hiding those of Python.
    return (*prefix, sys.executable, "-P", *_SCRIPT, str(program))
