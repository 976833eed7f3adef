"""ROS 1's own parameter code, run in the interpreter it is installed for."""

from __future__ import annotations

import pickle
import struct
import subprocess
from pathlib import Path
from typing import IO, Any

INTERPRETER = "/usr/bin/python3"
_PROBE = "import rosmaster.paramserver, rosparam, yaml"


def available() -> bool:
    """Tell whether Debian's python3-rosmaster and python3-rosparam are there."""
    if not Path(INTERPRETER).exists():
        return False
    probe = subprocess.run([INTERPRETER, "-c", _PROBE], capture_output=True, check=False)
    return probe.returncode == 0


class Ros1:
    """A process that answers for ROS 1."""

    def __init__(self) -> None:
        worker = Path(__file__).with_name("ros1_worker.py")
        self._process = subprocess.Popen(
            [INTERPRETER, str(worker)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )

    def call(self, name: str, *arguments: Any) -> Any:
        """Have the worker do something."""
        body = pickle.dumps([name, *arguments], protocol=4)
        stdin, stdout = _pipe(self._process.stdin), _pipe(self._process.stdout)
        stdin.write(struct.pack("<I", len(body)) + body)
        stdin.flush()
        (size,) = struct.unpack("<I", stdout.read(4))
        return pickle.loads(stdout.read(size))

    def close(self) -> None:
        """End the process."""
        _pipe(self._process.stdin).close()
        _pipe(self._process.stdout).close()
        self._process.wait(10)


def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
    if pipe is None:
        raise TypeError("expected a pipe")
    return pipe
