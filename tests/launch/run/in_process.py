"""Launches as processes of their own, for tests of output and signals."""

from __future__ import annotations

import os
import re
import secrets
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rosz.launch.plan.model import NodePlan, Plan
from rosz.launch.run.process_tree import TAG, ProcessTree

from .in_thread import TIMEOUT

PROGRAM = Path(__file__).with_name("program.py")
ROOT = Path(__file__).parents[3]


class LaunchProcess:
    """A running launch, whose output is read as it arrives.

    Args:
        process: The launch.
        reading: Descriptor of its output.
    """

    def __init__(self, process: subprocess.Popen[bytes], reading: int) -> None:
        self.process = process
        self.text = ""
        self._reading = reading

    def expect(self, pattern: str) -> re.Match[str]:
        """Read until a pattern has been seen."""
        deadline = time.monotonic() + TIMEOUT
        while (found := re.search(pattern, self.text)) is None:
            left = deadline - time.monotonic()
            ready, _, _ = select.select([self._reading], [], [], max(0.0, left))
            assert ready, f"no {pattern!r} in:\n{self.text}"
            assert self._read(), f"output ended without {pattern!r}:\n{self.text}"
        return found

    def _read(self) -> bool:
        try:
            data = os.read(self._reading, 65536)
        except OSError:  # a terminal whose other side is closed
            data = b""
        self.text += data.decode(errors="replace")
        return bool(data)

    def finish(self) -> int:
        """Read to the end, and return the exit code.

        The end may come later than that of the launch: its relay writes, too.
        """
        code = self.process.wait(TIMEOUT)
        while select.select([self._reading], [], [], TIMEOUT)[0] and self._read():
            pass
        return code

    def pids(self) -> list[int]:
        """Return the process ids of all started processes."""
        return [int(pid) for pid in re.findall(r"started with pid \[(\d+)\]", self.text)]


@contextmanager
def launch_process(
    folder: Path,
    *nodes: NodePlan,
    options: str = "{}",
    terminal: bool = False,
    prefix: tuple[str, ...] = (),
    separate: bool = False,
) -> Iterator[LaunchProcess]:
    """Run a launch in a process of its own, and leave no process behind.

    Args:
        folder: Folder for its files.
        *nodes: Nodes to run.
        options: Options as JSON.
        terminal: Whether it writes to a terminal.
        prefix: Words to put before its command.
        separate: Whether its errors go to the file ``FOLDER/err``.
    """
    tag = secrets.token_hex(8)
    plan = folder / "plan.json"
    plan.write_bytes(Plan(nodes=nodes).to_json())
    ours, theirs = os.openpty() if terminal else os.pipe()
    command = [*prefix, sys.executable, str(PROGRAM), str(folder), str(plan), options]
    err = (folder / "err").open("wb") if separate else None
    process = subprocess.Popen(
        command,
        stdin=theirs if terminal else subprocess.DEVNULL,
        stdout=theirs,
        stderr=err or theirs,
        env={**os.environ, "PYTHONPATH": str(ROOT), TAG: tag},
    )
    os.close(theirs)
    if err is not None:
        err.close()
    running = LaunchProcess(process, ours)
    try:
        yield running
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
        ProcessTree(tag).kill()
        os.close(ours)
