"""A roscore on a port of its own, and what is done to it."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import time
from pathlib import Path
from typing import Any

INTERPRETER = "/usr/bin/python3"
TIMEOUT = 30.0


def available() -> bool:
    """Tell whether Debian's ROS 1 is installed."""
    return shutil.which("roscore") is not None and shutil.which("rosparam") is not None


class Roscore:
    """A master, and a rospy node beside it.

    Args:
        folder: Where it leaves its logs.
    """

    def __init__(self, folder: Path) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        self.env = {
            **os.environ,
            "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
            "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(folder),
            "HOME": str(folder),
        }
        self._core = subprocess.Popen(
            ["roscore", "-p", str(port)],
            env=self.env,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._wait_for(port)
        self._node = subprocess.Popen(
            [INTERPRETER, str(Path(__file__).with_name("rospy_worker.py"))],
            env=self.env,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._read()

    def times(self, what: str, count: int) -> list[float]:
        """Return the seconds of so many calls of rospy, ``set`` or ``get``."""
        assert self._node.stdin is not None
        self._node.stdin.write(json.dumps([what, count]) + "\n")
        self._node.stdin.flush()
        found: list[float] = self._read()
        return found

    def close(self) -> None:
        """End both."""
        self._node.kill()
        self._node.wait(TIMEOUT)
        self._core.send_signal(signal.SIGINT)
        self._core.wait(TIMEOUT)

    def _read(self) -> Any:
        assert self._node.stdout is not None
        return json.loads(self._node.stdout.readline())

    def _wait_for(self, port: int) -> None:
        deadline = time.monotonic() + TIMEOUT
        while time.monotonic() < deadline:
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    return
            time.sleep(0.05)
        raise TimeoutError("roscore does not start")
