"""Runs a snippet twice: on Debian's ROS 1 modules, and on those of rosz."""

from __future__ import annotations

import contextlib
import io
import json
import subprocess
from functools import cache
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest

from rosz.ros1.importer import install, uninstall

PYTHON = "/usr/bin/python3"

_TRIES = """
import json, sys
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


@cache
def _has(module: str) -> bool:
    if not Path(PYTHON).exists():
        return False
    done = subprocess.run([PYTHON, "-c", f"import {module}"], check=False, capture_output=True)
    return done.returncode == 0


def real(snippet: str, module: str, package: str) -> Any:
    """Return the ``result`` of a snippet on the real modules.

    Args:
        snippet: Code that sets ``result``; it may use ``tried(function, *arguments)``.
        module: Real module that the snippet needs.
        package: Debian package of that module.
    """
    if not _has(module):
        pytest.skip(f"needs ROS 1's {module} (Debian: {package})")
    code = _TRIES + dedent(snippet) + "\nprint(json.dumps(plain(result)))\n"
    done = subprocess.run(
        [PYTHON, "-c", code],
        check=False,
        capture_output=True,
        text=True,
        timeout=30,
        env={"PATH": "/usr/bin:/bin", "HOME": "/nonexistent"},
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def ours(snippet: str) -> Any:
    """Return the ``result`` of a snippet on the modules of rosz."""
    space: dict[str, Any] = {}
    install()
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            exec(_TRIES + dedent(snippet) + "\nresult = plain(result)\n", space)
    finally:
        uninstall()
    return json.loads(json.dumps(space["result"]))


def same(snippet: str, module: str, package: str) -> None:
    """Check that a snippet has the same result on both."""
    expected = real(snippet, module, package)
    found = ours(snippet)
    assert found == expected, f"rosz: {found}\nreal: {expected}"
