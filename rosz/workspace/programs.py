"""Checks of the programs of a package, and of the launch files that start them.

Programs: executable bits, first lines, Python's syntax, C++ programs that nothing builds. Launch
files: each is planned with the defaults of its args. Files of dynamic_reconfigure (``.cfg``) are
programs, which are run. Nothing else is run.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from pathlib import Path

from rosz.errors import LaunchFileError, NotFoundError, PackageNotFound, RoszError
from rosz.launch.plan import NodePlan, SystemContext, describe_args, plan
from rosz.launch.run import locate
from rosz.packages import Package, PackageIndex, is_python
from rosz.ros1.python2 import explain
from rosz.workspace.problem import Problem, error, from_absence, from_error, warning

_SCRIPT_FOLDERS = frozenset({"scripts", "script", "nodes", "node", "bin", "test", "tests"})
_SKIPPED_FOLDERS = frozenset({"__pycache__", "node_modules", "build", "devel", "install"})
# The first line and the magic number of a binary; files may be large.
_HEAD_BYTES = 4096
_BINARY = b"\x7fELF"
_EXECUTABLE = re.compile(
    rb"^\s*(?:catkin_|cuda_|rosbuild_)?add_executable\s*\(\s*([^\s)]+)", re.MULTILINE
)
_COMPILED = re.compile(rb"^\s*(?:\w+_)?add_(?:executable|library)\s*\(", re.MULTILINE)
_PROJECT = re.compile(rb"^\s*project\s*\(\s*([^\s)]+)", re.MULTILINE)
_CFG_TIMEOUT = 20.0
_GENERATOR = b"ParameterGenerator"
_FRAME = re.compile(r'^\s*File "(.+)", line (\d+)', re.MULTILINE)
_LAUNCH_PATTERNS = ("*.launch", "*.launch.xml", "*.test")


def check_scripts(folder: Path) -> Iterator[Problem]:
    """Yield the problems of the programs of a package."""
    for file in _files(folder):
        try:
            with file.open("rb") as opened:
                head = opened.read(_HEAD_BYTES)
        except OSError as fault:
            yield warning(file, f"cannot be read: {fault.strerror}")
            continue
        yield from _check_start(folder, file, head)
        if is_python(file) or file.suffix == ".cfg":
            yield from _check_python(file)


def _files(folder: Path) -> Iterator[Path]:
    for parent, names, files in os.walk(folder):
        names[:] = sorted(n for n in names if not n.startswith(".") and n not in _SKIPPED_FOLDERS)
        yield from (Path(parent, name) for name in sorted(files) if not name.startswith("."))


def _check_start(folder: Path, file: Path, head: bytes) -> Iterator[Problem]:
    """Yield the problems that prevent a file from being started."""
    first = head.split(b"\n", 1)[0]
    executable = os.access(file, os.X_OK)
    if not first.startswith(b"#!"):
        if executable and file.suffix == ".py":
            text = "its first line names no interpreter: put '#!/usr/bin/env python3' there"
            yield warning(file, text, 1, 1)
        elif executable and _is_started(folder, file) and not head.startswith(_BINARY):
            yield error(file, "executable, but neither a program nor a script with '#!'", 1, 1)
        return
    if not executable and _is_started(folder, file):
        yield error(file, f"not executable; run: chmod +x {file}")
    if first.endswith(b"\r"):
        yield warning(
            file,
            f"lines end as on Windows, which does not work with '#!': sed -i 's/\\r$//' {file}",
            1,
        )
    yield from _check_interpreter(file, first[2:].decode(errors="replace").split())


def _is_started(folder: Path, file: Path) -> bool:
    """Return whether a file is in a folder for programs."""
    place = file.relative_to(folder).parent.parts
    return not place or place == ("src",) or bool(_SCRIPT_FOLDERS & set(place))


def _check_interpreter(file: Path, words: list[str]) -> Iterator[Problem]:
    if not words:
        yield error(file, "'#!' names no interpreter; write '#!/usr/bin/env python3'", 1, 1)
        return
    program = words[0]
    if Path(program).name == "env":
        rest = [word for word in words[1:] if not word.startswith("-") and "=" not in word]
        program = rest[0] if rest else "env"
    if shutil.which(program) is None:
        # rosz runs Python scripts with its own interpreter.
        if "python" in program:
            text = f"'{program}' is not on this machine: only rosz can start it; use 'python3'"
            yield warning(file, text, 1, 1)
        else:
            yield error(file, f"its interpreter '{program}' is not on this machine", 1, 1)


def _check_python(file: Path) -> Iterator[Problem]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            compile(file.read_bytes(), str(file), "exec", dont_inherit=True)
    except SyntaxError as fault:
        plain = explain(fault, str(file))
        if plain is not None:
            yield from_error(plain, file)
        else:
            text = f"not valid Python: {fault.msg}"
            yield error(file, text, fault.lineno or 0, fault.offset or 0)
    except ValueError as fault:  # null bytes
        yield error(file, f"not valid Python: {fault}")


def check_entry_points(package: Package) -> Iterator[Problem]:
    """Yield the entry points in setup.py that lead to no module."""
    for name in package.executables():
        try:
            package.executable(name)
        except NotFoundError as fault:
            yield error(package.path / "setup.py", str(fault))


def compiled_programs(folder: Path) -> dict[str, int]:
    """Return the C++ programs of a package, and the lines of CMakeLists.txt that name them."""
    try:
        data = (folder / "CMakeLists.txt").read_bytes()
    except OSError:
        return {}
    project = _PROJECT.search(data)
    own = project[1] if project is not None else folder.name.encode()
    return {
        match[1].replace(b"${PROJECT_NAME}", own).decode(errors="replace"): data.count(
            b"\n", 0, match.start(1)
        )
        + 1
        for match in _EXECUTABLE.finditer(data)
    }


def is_compiled(folder: Path) -> bool:
    """Return whether a package has C++ programs or libraries."""
    try:
        return _COMPILED.search((folder / "CMakeLists.txt").read_bytes()) is not None
    except OSError:
        return False


def check_cmake(package: Package) -> Iterator[Problem]:
    """Yield a problem that names the C++ programs of a package that are not built."""
    folder, built = package.path, package.executables()
    programs = {name: at for name, at in compiled_programs(folder).items() if name not in built}
    if programs:
        names = ", ".join(programs)
        text = f"C++ programs, which only 'catkin_make' builds (rosz help cpp): {names}"
        yield warning(folder / "CMakeLists.txt", text, min(programs.values()))


def check_configs(
    folder: Path, environ: Mapping[str, str], wrong: Container[str]
) -> Iterator[Problem]:
    """Yield the problems of the .cfg files of a package.

    Args:
        folder: Folder of the package.
        environ: Environment variables to run them with.
        wrong: Paths of files that have an error already; they are not run.
    """
    for file in sorted(folder.rglob("*.cfg")):
        if not file.is_file() or _GENERATOR not in file.read_bytes():
            continue  # another kind of configuration
        if not os.access(file, os.X_OK):
            yield warning(file, f"not executable, which catkin requires; run: chmod +x {file}")
        if str(file) not in wrong:
            yield from _run_config(file, environ)


def _run_config(file: Path, environ: Mapping[str, str]) -> Iterator[Problem]:
    command = [sys.executable, "-P", "-m", "rosz.ros1", str(file)]
    with tempfile.TemporaryDirectory(prefix="rosz-cfg-") as scratch:
        try:
            done = subprocess.run(
                command,
                cwd=scratch,
                env={**environ, "PYTHONDONTWRITEBYTECODE": "1"},
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                timeout=_CFG_TIMEOUT,
                check=False,
            )
        except subprocess.TimeoutExpired:
            yield error(
                file, f"still runs after {_CFG_TIMEOUT:g} s; it should only describe settings"
            )
            return
    if done.returncode:
        lines = [int(line) for path, line in _FRAME.findall(done.stderr) if path == str(file)]
        output = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        text = re.sub(rf"^(ERROR: )?({re.escape(str(file))}(:\d+)*: )?", "", output[-1])
        yield error(file, text, lines[-1] if lines else 0)


class _DryContext(SystemContext):
    def run(self, command: Sequence[str]) -> bytes:  # noqa: ARG002  # as in the base class
        return b""


def check_launches(
    folder: Path, index: PackageIndex, environ: Mapping[str, str]
) -> Iterator[Problem]:
    """Yield the problems of the launch files of a package.

    Args:
        folder: Folder of the package.
        index: All known packages.
        environ: Environment variables.
    """
    context = _DryContext(index, environ, folder, lambda base: f"{base}_1")
    for file in sorted({file for pattern in _LAUNCH_PATTERNS for file in folder.rglob(pattern)}):
        faults: list[LaunchFileError] = []
        planned = None
        try:
            # A file with required args is meant to be included by another one.
            if all(arg.default is not None for arg in describe_args([file], {}, context)):
                planned = plan([file], {}, context, faults=faults)
        except RoszError as fault:
            yield from_error(fault, file)
        yield from (from_error(fault, file) for fault in faults)
        if planned is not None:
            for notice in planned.warnings:
                place = notice.place
                yield warning(Path(place.file), notice.text, place.line, place.column)
            for node in planned.processes:
                yield from _check_node(node, index, lambda path: path.is_relative_to(folder))


def _check_node(
    node: NodePlan, index: PackageIndex, is_ours: Callable[[Path], bool]
) -> Iterator[Problem]:
    """Yield the problems that prevent a node from being started."""
    if node.command or node.machine:
        return
    place = Path(node.place.file), node.place.line, node.place.column
    try:
        package = index.find(node.package)
    except PackageNotFound as fault:
        yield from_absence(fault, place[0], node.name, place[1:])
        return
    except RoszError as fault:
        yield warning(place[0], f"node '{node.name}': {fault}", *place[1:])
        return
    try:
        locate(package, node.type)
    except NotFoundError as fault:
        text = f"node '{node.name}': {fault}"
        if node.type in compiled_programs(package.path):
            text = f"'{node.type}' of package '{package.name}' is C++, and is not built"
        make = error if is_ours(package.path) else warning
        yield make(place[0], text, *place[1:])
