"""Linux namespaces that end with the test, whatever becomes of it."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Self

import pytest

__all__ = ("Namespace", "children", "why_not")

_TIMEOUT = 100.0
_ENTER = {"-n": "--net", "-u": "--uts", "-m": "--mount", "-p": "--pid", "-i": "--ipc"}


def why_not() -> str:
    """Return why hosts cannot be made here; empty where they can."""
    if sys.platform != "linux":
        return "network namespaces need Linux"
    missing = [word for word in ("ip", "bridge", "unshare", "nsenter") if not shutil.which(word)]
    if missing:
        return f"{', '.join(missing)} is missing: install iproute2 and util-linux"
    tried = subprocess.run(
        ["unshare", *_ENTER, "--fork", "true"], capture_output=True, text=True, check=False
    )
    return f"no namespaces without privileges: {tried.stderr.strip()}" if tried.returncode else ""


def children(pid: int) -> list[int]:
    """Return the children of a process."""
    try:
        text = Path(f"/proc/{pid}/task/{pid}/children").read_text()
    except OSError:  # it is gone
        return []
    return [int(word) for word in text.split()]


class Namespace:
    """A network, process table, host name and mounts of its own, empty at first."""

    def __init__(self) -> None:
        self._holder = subprocess.Popen(
            [
                *("unshare", *_ENTER, "--fork", "--mount-proc", "--kill-child"),
                *(sys.executable, "-I", "-S", str(Path(__file__).with_name("holder.py"))),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._holder.stdout is not None
        if self._holder.stdout.readline() != "up\n":
            pytest.fail("a namespace does not come up")
        (self.pid,) = children(self._holder.pid)
        self.run("ip", "link", "set", "lo", "up")

    def inside(self, command: Sequence[str]) -> list[str]:
        """Return a command that runs another one inside, in a session of its own."""
        return ["nsenter", "-t", str(self.pid), *_ENTER, "--", "setsid", *command]

    def run(self, *command: str) -> str:
        """Run a command inside, and return what it prints; it must succeed."""
        done = subprocess.run(
            self.inside(command), capture_output=True, text=True, timeout=_TIMEOUT, check=False
        )
        if done.returncode:
            pytest.fail(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr}")
        return done.stdout

    def write(self, file: str, text: str) -> None:
        """Write a file as it is seen inside, such as one of ``/proc/sys``."""
        self.run("sh", "-c", 'printf %s "$1" >"$2"', "sh", text, file)

    def pids(self) -> list[int]:
        """Return all living processes inside but the holder, by their numbers outside."""
        mine = Path(f"/proc/{self.pid}/ns/pid").readlink()
        found = []
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit() and int(entry.name) != self.pid:
                try:
                    same = (entry / "ns/pid").readlink() == mine
                    # What brought it here may be stopped, and takes no note of its end.
                    dead = (entry / "stat").read_text().rpartition(") ")[2].startswith("Z")
                except OSError:  # it ended meanwhile
                    continue
                if same and not dead:
                    found.append(int(entry.name))
        return sorted(found)

    def close(self) -> None:
        """End it with all that runs inside; again is no error."""
        assert self._holder.stdin is not None
        assert self._holder.stdout is not None
        self._holder.stdin.close()
        self._holder.wait(_TIMEOUT)
        self._holder.stdout.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exc: object) -> None:
        self.close()
