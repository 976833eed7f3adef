"""Real ROS 1, which tests compare rosz with.

Debian installs ROS 1 for the interpreter of the system, so it runs in other processes: `real` runs
a snippet there, and a `Worker` serves many calls. Both skip the test where ROS 1 is missing. Tests
that use them have the mark ``ros1``, which `require` checks.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import pickle
import struct
import subprocess
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from textwrap import dedent
from typing import IO, Any

import pytest

from rosz.ros1.importer import install, uninstall

__all__ = (
    "HEAD",
    "MESSAGES",
    "PYTHON",
    "Worker",
    "is_installed",
    "ours",
    "real",
    "require",
    "same",
)

PYTHON = "/usr/bin/python3"
MESSAGES = Path("/usr/lib/python3/dist-packages")
"""Folder of Debian's generated message modules."""

_RESULT = "\x1eresult:"
HEAD = """
import json, os, sys
def tried(function, *arguments):
    try:
        return plain(function(*arguments))
    except Exception as error:
        return ["raises", type(error).__name__]
def plain(value):
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (tuple, list)):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return round(value, 9)
    if isinstance(value, dict):
        return {str(key): plain(one) for key, one in value.items()}
    return value if isinstance(value, (str, int, bool, type(None))) else str(value)
"""

marked = True
"""Whether the test that runs has the mark ``ros1``; set before each test."""


@cache
def is_installed(*modules: str) -> bool:
    """Return whether the system's interpreter can import real modules."""
    if not Path(PYTHON).exists():
        return False
    command = [PYTHON, "-c", f"import {', '.join(modules)}"]
    return subprocess.run(command, check=False, capture_output=True).returncode == 0


def require(*modules: str, package: str) -> None:
    """Skip the test where real modules are missing.

    Args:
        modules: The modules.
        package: Debian packages of the modules.
    """
    assert marked, "a test that compares with ROS 1 needs the mark 'ros1'"
    if not is_installed(*modules):
        pytest.skip(f"needs {', '.join(modules)} of ROS 1 (Debian: {package})")


def real(snippet: str, module: str, package: str, *, given: Any = None, home: str = "") -> Any:
    """Return the ``result`` of a snippet on the real modules.

    Args:
        snippet: Code that sets ``result``; it may use ``given`` and ``tried(function, *args)``.
        module: Real module that the snippet needs.
        package: Debian package of that module.
        given: Input of the snippet, of types that JSON has.
        home: Folder for what ROS writes; none when empty.
    """
    require(module, package=package)
    end = f"sys.__stdout__.write({_RESULT!r} + json.dumps(plain(result)))"
    end += "\nsys.__stdout__.flush()\nos._exit(0)\n"  # threads of a snippet may still run
    done = subprocess.run(
        [PYTHON, "-c", f"{HEAD}\ngiven = json.load(sys.stdin)\n{dedent(snippet)}\n{end}"],
        input=json.dumps(given),
        check=False,
        capture_output=True,
        text=True,
        timeout=300,
        cwd=home or None,
        env={
            "PATH": "/usr/bin:/bin",
            "HOME": home or "/nonexistent",
            "ROS_IP": "127.0.0.1",
            "TZ": "UTC",
            **({"ROS_HOME": home} if home else {}),
        },
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.partition(_RESULT)[2])


def ours(snippet: str) -> Any:
    """Return the ``result`` of a snippet on the modules of rosz."""
    space: dict[str, Any] = {}
    install()
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            exec(HEAD + dedent(snippet) + "\nresult = plain(result)\n", space)
    finally:
        uninstall()
    return json.loads(json.dumps(space["result"]))


def same(snippet: str, module: str, package: str) -> None:
    """Check that a snippet has the same result on both."""
    expected = real(snippet, module, package)
    found = ours(snippet)
    assert found == expected, f"rosz: {found}\nreal: {expected}"


class Worker:
    """A process that calls functions with real ROS 1; it starts anew after a call that broke off.

    Args:
        calls: Name of the module of this package whose functions it calls.
        variables: Its environment; that of the tests when None.
    """

    def __init__(self, calls: str, variables: Mapping[str, str] | None = None) -> None:
        self._calls = calls
        self._variables = dict(os.environ if variables is None else variables)
        self._start()

    def _start(self) -> None:
        self._process = subprocess.Popen(
            [PYTHON, str(Path(__file__).with_name("worker.py")), self._calls],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=self._variables,
        )

    def call(self, function: str, *args: Any, **options: Any) -> Any:
        """Return the result of a function."""
        body = pickle.dumps((function, args, options), protocol=4)
        stdin, stdout = _pipe(self._process.stdin), _pipe(self._process.stdout)
        try:
            stdin.write(struct.pack("<I", len(body)) + body)
            stdin.flush()
            head = stdout.read(4)
            assert head, f"the worker ended in a call of {function}"
            reply = stdout.read(*struct.unpack("<I", head))
        except BaseException:  # such as a time limit: the reply would be taken for the next one
            self._process.kill()
            self.close()
            self._start()
            raise
        failed, result = pickle.loads(reply)
        assert not failed, result
        return result

    def close(self) -> None:
        """End the process."""
        with contextlib.suppress(BrokenPipeError):
            _pipe(self._process.stdin).close()
        self._process.wait(60)
        _pipe(self._process.stdout).close()


def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
    assert pipe is not None
    return pipe
