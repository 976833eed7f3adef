"""The processes of the benchmark, and the network that they share."""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

__all__ = ("Lab", "Peer")

ROOT = Path(__file__).parents[3]
DEBIAN_PYTHON = "/usr/bin/python3"
TIMEOUT = 30.0
SHARED_FROM = 100_000
"""Bytes from which on samples go by shared memory, where that is on."""


class Peer:
    """A process that takes part; ends with the block.

    Args:
        command: How to start it.
        variables: The environment.
    """

    def __init__(self, command: list[str], variables: dict[str, str]) -> None:
        self._command = command
        self._process = subprocess.Popen(
            command,
            env=variables,
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def read(self) -> Any:
        """Return what it says next, past what its system logs on the same stream."""
        assert self._process.stdout is not None
        for line in self._process.stdout:
            try:
                return json.loads(line)
            except json.JSONDecodeError:
                sys.stderr.write(line)
        raise SystemExit(f"{' '.join(self._command)} ended too early")

    def ask(self) -> Any:
        """Return what it answers to a line."""
        assert self._process.stdin is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        return self.read()

    def wait(self) -> None:
        """Wait until it has ended by itself."""
        self._process.wait(TIMEOUT)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            self._process.wait(TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class Lab:
    """Starts peers, each pair on a network of its own.

    Args:
        folder: For what the processes write.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._master = free_port()
        self.real = shutil.which("roscore") is not None and Path(DEBIAN_PYTHON).exists()
        self.renew()

    def renew(self) -> None:
        """Have the peers that come next meet nobody who is there already."""
        self._rendezvous = f"tcp/127.0.0.1:{free_port()}"

    @contextmanager
    def master(self) -> Iterator[None]:
        """Run a roscore while the block runs, where there is one."""
        if not self.real:
            yield
            return
        with subprocess.Popen(
            ["roscore", "-p", str(self._master)],
            env=self._variables("rospy"),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ) as process:
            try:
                yield
            finally:
                process.terminate()

    def peer(self, system: str, role: str, *arguments: str) -> Peer:
        """Start a peer that says nothing before it is told to."""
        # rospy warns of publishers without a queue, which are measured on purpose.
        quiet = [DEBIAN_PYTHON, "-W", "ignore"]
        python = quiet if system.startswith("rospy") else [sys.executable]
        command = [*python, "-m", "tests.bench.topics.peer", system, role, *arguments]
        return Peer(command, self._variables(system))

    @contextmanager
    def ready(self, system: str, role: str, *arguments: str) -> Iterator[Peer]:
        """Have a peer take part, from when it is ready, while the block runs."""
        with self.peer(system, role, *arguments) as peer:
            peer.read()
            yield peer

    def _variables(self, system: str) -> dict[str, str]:
        kept = {name: os.environ[name] for name in ("PATH", "LANG") if name in os.environ}
        return {
            **kept,
            "HOME": str(self._folder),
            "ROS_HOME": str(self._folder),
            "ROS_IP": "127.0.0.1",
            "ROS_MASTER_URI": f"http://127.0.0.1:{self._master}",
            "ROSZ_RENDEZVOUS": self._rendezvous,
            "ROSZ_SHM": str(SHARED_FROM) if system == "rosz, shared memory" else "0",
        }


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
