"""Checking .cfg files of dynamic_reconfigure: each is a program, and is run as one."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path

from rosz.workspace.problem import Problem, error, warning

__all__ = ("check_configs",)

_SECONDS = 20.0
_GENERATOR = b"ParameterGenerator"
_FRAME = re.compile(r'^\s*File "(.+)", line (\d+)', re.MULTILINE)


def check_configs(folder: Path, environ: Mapping[str, str]) -> Iterator[Problem]:
    """Yield what is wrong with the .cfg files of a package.

    Args:
        folder: The package.
        environ: Variables to run them with.
    """
    for file in sorted(folder.rglob("*.cfg")):
        if not file.is_file() or _GENERATOR not in file.read_bytes():
            continue  # some other kind of configuration
        if not os.access(file, os.X_OK):
            yield warning(file, f"not executable, which catkin asks for; run: chmod +x {file}")
        if find_spec("rosz.ros1.dynamic_reconfigure") is not None:
            yield from _run(file, environ)


def _run(file: Path, environ: Mapping[str, str]) -> Iterator[Problem]:
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
                timeout=_SECONDS,
                check=False,
            )
        except subprocess.TimeoutExpired:
            yield error(file, f"still runs after {_SECONDS:g} s; it should only describe settings")
            return
    if done.returncode:
        lines = [int(line) for path, line in _FRAME.findall(done.stderr) if path == str(file)]
        said = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        yield error(file, _without_place(said[-1], file), lines[-1] if lines else 0)


def _without_place(text: str, file: Path) -> str:
    return re.sub(rf"^(rosz: )?({re.escape(str(file))}(:\d+)*: )?", "", text)
