"""The commands that run nodes of a plan, and the programs of ``rosz run``.

A Python script runs with the interpreter that runs rosz, and can import ROS 1's modules
(``python -m rosz.script SCRIPT``); any other program runs as it is. It finds ROS 1's commands, and
Python programs that it starts find ROS 1's modules, as in a shell with ``rosz env``.
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
from rosz.errors import ExecutableNotFound, LaunchError, NotFoundError, UsageError
from rosz.launch.plan import NodePlan
from rosz.launch.run import report
from rosz.launch.run.process_tree import TAG
from rosz.packages import Package, PackageIndex, is_python, start_words
from rosz.params.yaml import inline
from rosz.program import ProgramSpec
from rosz.remap import parse

_LAUNCH_SUFFIXES = (".launch", ".launch.xml")
_PYTHON = re.compile(r"python[0-9.]*")
_SCRIPT = ("-m", "rosz.script")
_ROSZ = Path(__file__).parents[2]
_COMMANDS = str(_ROSZ / "cli" / "bin")
_MODULES = str(_ROSZ / "ros1" / "shell")
_CONTAINER = ("-P", *_SCRIPT, "--container")


class NodeCommand(msgspec.Struct, frozen=True):
    """A command to execute.

    Attributes:
        shown: The same for messages: the script without its interpreter.
        python: Whether it is a Python script that rosz runs.
        direct: Whether it gets the terminal of the launch, which a debugger needs.
    """

    argv: tuple[str, ...]
    shown: tuple[str, ...]
    environ: dict[str, str]
    cwd: str
    python: bool = False
    direct: bool = False


class Workplace(msgspec.Struct, frozen=True):
    """The packages and settings from which commands are made.

    Attributes:
        cwd: Folder in which the launch was started.
    """

    packages: PackageIndex
    environment: Environment
    environ: Mapping[str, str]
    cwd: str

    def command(self, node: NodePlan, *, log_file: Path | None, tag: str) -> NodeCommand:
        """Return the command of a node.

        Without the path of a log file, the log is left to the node.

        Raises:
            PackageNotFound: If there is no such package.
            ExecutableNotFound: If the package has no such executable.
        """
        environ = base_environ(self.environ, self.environment)
        environ.pop("ROS_NAMESPACE", None)
        environ |= report.environment(node) | {TAG: tag}
        if node.members:
            return self._container(node, environ, log_file)
        direct = bool(node.launch_prefix) and node.output == "screen"
        if node.command and not node.type:
            words = tuple(report.command_line(node, self.find))
            environ = _with_ros1_names(environ) if node.ros2 else environ
            return NodeCommand(words, words, environ, self._cwd(node.cwd, None), direct=direct)
        shown = (*report.command_line(node, self.find), *_ros_params(node))
        prefixed = len(node.launch_prefix)
        program = Path(shown[prefixed])
        python = is_python(program)
        if log_file is not None and (python or not node.ros2):
            shown = (*shown, *["-r"] * node.ros2, f"__log:={log_file}")
        if not python:
            environ = _with_ros1_names(environ)
        start = _start(node.launch_prefix, program, python=python)
        return NodeCommand(
            argv=(*start, *shown[prefixed + 1 :]),
            shown=shown,
            environ=environ,
            cwd=self._cwd(node.cwd, program),
            python=python,
            direct=direct,
        )

    def _container(
        self, node: NodePlan, environ: dict[str, str], log_file: Path | None
    ) -> NodeCommand:
        environ.pop("ROS_NAMESPACE", None)
        specs = [
            self._program(member, log_file)
            for member in node.members
            if member.full_name != node.full_name
        ]
        return container_command(
            node.full_name,
            specs,
            environ,
            self._cwd(node.cwd, Path()),
            by_reference=node.by_reference,
            node=len(specs) < len(node.members),
        )

    def _program(self, node: NodePlan, log_file: Path | None) -> ProgramSpec:
        program, *words = report.command_line(node, self.find)
        if not is_python(Path(program)):
            raise LaunchError(f"'{program}' is not a Python script, which a container runs")
        if node.namespace != "/":
            words.append(f"__ns:={node.namespace}")
        if log_file is not None:
            own = f"{log_file.stem}-{node.full_name.strip('/').replace('/', '-')}.log"
            words.append(f"__log:={log_file.with_name(own)}")
        return ProgramSpec(
            name=node.full_name,
            script=program,
            arguments=tuple(words),
            respawn=node.respawn,
            respawn_delay=node.respawn_delay,
            respawn_max=node.respawn_max,
            required=node.required,
        )

    def find(self, package: str, executable: str) -> str:
        """Return the path of an executable.

        Raises:
            PackageNotFound: If there is no such package.
            ExecutableNotFound: If the package has no such executable.
        """
        return str(locate(self.packages.find(package), executable))

    def may_need_master(self, node: NodePlan) -> bool:
        """Return whether a node may speak ROS 1's protocol, if it runs on this machine.

        Then it is no Python script, but compiled, or a script of a shell that starts others.
        """
        if node.command:
            return False
        try:
            return not is_python(Path(self.find(node.package, node.type)))
        except NotFoundError:
            return False  # the launch tells when it starts the node

    def _cwd(self, choice: str, program: Path | None) -> str:
        if choice.lower() == "node" and program is not None:
            return str(program.parent)
        if choice.lower() in {"", "ros_home"}:
            return str(self.environment.home) if program is not None else self.cwd
        return str(Path(self.cwd, choice))


def _ros_params(node: NodePlan) -> list[str]:
    """Return the arguments for the parameters of a node of ROS 2."""
    words: list[str] = []
    for source in node.ros_params:
        values = source.items() if isinstance(source, dict) else ()
        words += ["--params-file", source] if isinstance(source, str) else []
        words += [word for name, value in values for word in ("-p", f"{name}:={inline(value)}")]
    return words


def run_command(
    workplace: Workplace, package: str, executable: str, args: Sequence[str], prefix: str = ""
) -> NodeCommand:
    """Return the command of ``rosz run``, which replaces this process.

    Args:
        workplace: The packages and settings.
        package: Name of the package.
        executable: Name of the file, or its path within the package.
        args: Arguments as given.
        prefix: Command to put before it, split as a shell does.

    Raises:
        PackageNotFound: If there is no such package.
        ExecutableNotFound: If the package has no such executable.
    """
    program = locate(workplace.packages.find(package), executable)
    before = tuple(shlex.split(prefix))
    python = is_python(program)
    environ = base_environ(workplace.environ, workplace.environment)
    return NodeCommand(
        argv=(*_start(before, program, python=python), *args),
        shown=(*before, str(program), *args),
        environ=environ if python else _with_ros1_names(environ),
        cwd=workplace.cwd,
        python=python,
        direct=True,
    )


def container_of(
    workplace: Workplace, commands: Sequence[str], *, by_reference: bool = False
) -> NodeCommand:
    """Return the command of ``rosz run --with``.

    Args:
        workplace: The packages and settings.
        commands: Package, executable and arguments of each program, split as a shell does.
        by_reference: Whether nodes of rospy pass on messages themselves.

    Raises:
        PackageNotFound: If there is no such package.
        ExecutableNotFound: If the package has no such executable.
        LaunchError: If a program is not a Python script, or two have one node name.
        UsageError: If a command does not name a package and an executable.
    """
    specs: list[ProgramSpec] = []
    for command in commands:
        package, executable, *words = _split(command)
        script = locate(workplace.packages.find(package), executable)
        if not is_python(script):
            raise LaunchError(
                f"'{script}' is not a Python script, and only those share a process; run it alone"
            )
        given = parse(words).special
        name = given.get("__name", f"{package}/{executable}")
        if any(spec.name == name for spec in specs):
            if "__name" in given:
                raise LaunchError(f"two nodes of one process are named '{name}'")
            name = f"{name} ({len(specs) + 1})"
        specs.append(ProgramSpec(name=name, script=str(script), arguments=tuple(words)))
    return container_command(
        "rosz run",
        specs,
        base_environ(workplace.environ, workplace.environment),
        workplace.cwd,
        by_reference=by_reference,
    )


def _split(command: str) -> list[str]:
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise UsageError(f"--with '{command}' cannot be split into words: {error}") from error
    if len(words) < 2:  # noqa: PLR2004  # a package and an executable
        raise UsageError(f"--with is '{command}'; expected 'PACKAGE EXECUTABLE [ARGS]'")
    return words


def container_command(  # those of a command
    name: str,
    programs: Sequence[ProgramSpec],
    environ: dict[str, str],
    cwd: str,
    *,
    by_reference: bool = False,
    node: bool = False,
) -> NodeCommand:
    """Return the command that runs several Python programs in one process."""
    options = [*["--by-reference"] * by_reference, *["--node"] * node]
    specs = [msgspec.json.encode(program).decode() for program in programs]
    shown = [f"{spec.script} {' '.join(spec.arguments)}".strip() for spec in programs]
    return NodeCommand(
        argv=(sys.executable, *_CONTAINER, name, *options, *specs),
        shown=(f"container {name}:", " + ".join(shown)),
        environ=environ,
        cwd=cwd,
        python=True,
    )


def base_environ(environ: Mapping[str, str], environment: Environment) -> dict[str, str]:
    """Return the environment variables of a child: those of this process, and the package path.

    The child may start in another folder, from which it would find other packages.
    """
    roots = os.pathsep.join(str(root) for root in environment.package_roots)
    return {**environ, "ROSZ_PACKAGE_PATH": roots} if roots else dict(environ)


def _with_ros1_names(environ: Mapping[str, str]) -> dict[str, str]:
    """Return variables with which a script of a shell finds ROS 1's commands and modules."""
    path = environ.get("PATH", os.defpath).split(os.pathsep)
    modules = [part for part in environ.get("PYTHONPATH", "").split(os.pathsep) if part]
    if _COMMANDS not in path:
        path.insert(0, _COMMANDS)
    if _MODULES not in modules:
        modules.append(_MODULES)
    return {
        **environ,
        "PATH": os.pathsep.join(path),
        "PYTHONPATH": os.pathsep.join(modules),
        "ROSZ_PYTHON": sys.executable,
    }


def locate(package: Package, name: str) -> Path:
    """Return the path of an executable by its name, or by its path within the package.

    Raises:
        ExecutableNotFound: If it does not exist, or is not executable.
    """
    if name.endswith(_LAUNCH_SUFFIXES) and package.files(name.rpartition("/")[2]):
        raise ExecutableNotFound(
            f"'{name}' is a launch file, not a program; use roslaunch, or: rosz launch"
            f" {package.name} {name}"
        )
    if "/" not in name:
        return package.executable(name)
    path = package.within(name)
    if path.is_file() and os.access(path, os.X_OK):
        return path
    if path.is_file():
        raise ExecutableNotFound(f"'{path}' is not executable; run: chmod +x {path}")
    raise ExecutableNotFound(
        f"package '{package.name}' has no file '{path}'; give only the name of the executable to"
        " search for it"
    )


def _start(prefix: Sequence[str], program: Path, *, python: bool) -> tuple[str, ...]:
    """Return the words before the program's own arguments."""
    if not python:
        return (*prefix, str(program))
    if prefix and _PYTHON.fullmatch(Path(prefix[0]).name):
        # "python3 -m pdb", "python -u": a named interpreter keeps its options.
        return (sys.executable, *prefix[1:], *_SCRIPT, str(program))
    return (*prefix, *start_words(program))
