"""Questions to the real rospy, where the machine has one."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

_PYTHON = Path("/usr/bin/python3")
_ANSWER = "\x1eanswer:"


def ask(script: str, question: object, home: Path) -> Any:
    """Run a script with the system's Python, and return its output.

    Args:
        script: Gets `question`, and calls `answer` with its result. Skips the test where rospy is
            not installed.
        question: Anything that JSON can hold.
        home: Folder for what ROS writes.
    """
    head = (
        "import json, sys\n"
        "try:\n    import rospy, rosmaster\n"
        "except ImportError as error:\n    sys.exit(f'missing: {error}')\n"
        "question = json.load(sys.stdin)\n"
        f"def answer(value): sys.__stdout__.write({_ANSWER!r} + json.dumps(value))\n"
    )
    if not _PYTHON.exists():
        pytest.skip(f"no Python at {_PYTHON}, so no rospy to compare with")
    environ = {
        "PATH": os.environ["PATH"],
        "HOME": str(home),
        "ROS_HOME": str(home),
        "ROS_IP": "127.0.0.1",
        "TZ": "UTC",
    }
    done = subprocess.run(
        [_PYTHON, "-c", head + script],
        input=json.dumps(question),
        capture_output=True,
        text=True,
        timeout=50,
        check=False,
        env=environ,
        cwd=home,
    )
    if done.stderr.startswith("missing: "):
        pytest.skip(f"rospy to compare with is {done.stderr.strip()}")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.partition(_ANSWER)[2])
