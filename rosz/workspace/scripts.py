"""Checking what is executed: executable bits, first lines, Python's syntax, C++ nobody builds."""

from __future__ import annotations

import os
import re
import shutil
import warnings
from collections.abc import Iterator
from pathlib import Path

from rosz.launch.run.command import is_python
from rosz.ros1.python2 import explain
from rosz.workspace.problem import Problem, error, from_error, warning

__all__ = ("check_cmake", "check_scripts")

_SCRIPT_FOLDERS = frozenset({"scripts", "script", "nodes", "node", "bin", "test", "tests"})
_NO_CODE = frozenset({"__pycache__", "node_modules", "build", "devel", "install"})
_HEAD_BYTES = 4096
_BINARY = b"\x7fELF"
_EXECUTABLE = re.compile(rb"^\s*(?:catkin_|cuda_)?add_executable\s*\(\s*([^\s)]+)", re.MULTILINE)


def check_scripts(folder: Path) -> Iterator[Problem]:
    """Yield what is wrong with the programs of a package."""
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
        names[:] = sorted(n for n in names if not n.startswith(".") and n not in _NO_CODE)
        yield from (Path(parent, name) for name in sorted(files) if not name.startswith("."))


def _check_start(folder: Path, file: Path, head: bytes) -> Iterator[Problem]:
    """Yield what keeps a file from being started."""
    first = head.split(b"\n", 1)[0]
    executable = os.access(file, os.X_OK)
    if not first.startswith(b"#!"):
        if executable and file.suffix == ".py":
            text = "no first line says what runs it: put '#!/usr/bin/env python3' there"
            yield warning(file, text, 1, 1)
        elif executable and _is_started(folder, file) and not head.startswith(_BINARY):
            yield error(file, "executable, but neither a program nor a script with '#!'", 1, 1)
        return
    if not executable and _is_started(folder, file):
        yield error(file, f"not executable; run: chmod +x {file}")
    if first.endswith(b"\r"):
        yield warning(
            file, f"lines end as on Windows, which '#!' does not take: sed -i 's/\\r$//' {file}", 1
        )
    yield from _check_interpreter(file, first[2:].decode(errors="replace").split())


def _is_started(folder: Path, file: Path) -> bool:
    """Tell whether a file lies where a package has the programs that it starts."""
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
        # rosz runs Python scripts with its own interpreter, whatever their first line says.
        if "python" in program:
            text = f"'{program}' is not on this machine: only rosz starts it, 'python3' would do"
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
            text = f"no valid Python: {fault.msg}"
            yield error(file, text, fault.lineno or 0, fault.offset or 0)
    except ValueError as fault:  # null bytes
        yield error(file, f"no valid Python: {fault}")


def check_cmake(folder: Path) -> Iterator[Problem]:
    """Yield the C++ programs of a package: rosz starts what is built, and builds nothing."""
    file = folder / "CMakeLists.txt"
    try:
        data = file.read_bytes()
    except OSError:
        return
    for match in _EXECUTABLE.finditer(data):
        line = data.count(b"\n", 0, match.start(1)) + 1
        name = match[1].decode(errors="replace")
        yield warning(file, f"'{name}' is C++: rosz builds none, and has no C++ API", line)
