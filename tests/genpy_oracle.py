"""Runs real genpy in another process."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

PYTHON = "/usr/bin/python3"


class Oracle:
    """A running worker; close it when done."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [PYTHON, str(Path(__file__).with_name("genpy_worker.py"))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={"PATH": "/usr/bin:/bin"},
        )

    def ask(self, **request: Any) -> dict[str, Any]:
        """Return the response: a value, or the error of genpy."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        answer: dict[str, Any] = json.loads(self._process.stdout.readline())
        return answer

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(10)
        self._process.stdout.close()


def start() -> Oracle:
    """Start a worker, or skip the test where genpy is not installed."""
    done = (
        subprocess.run(
            [PYTHON, "-c", "import genpy, std_msgs.msg"], check=False, capture_output=True
        )
        if Path(PYTHON).exists()
        else None
    )
    if done is None or done.returncode:
        pytest.skip("needs genpy and std_msgs of ROS 1 (Debian: python3-genpy, python3-std-msgs)")
    return Oracle()
