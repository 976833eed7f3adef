"""Terminals of a student: bash on a pseudo-terminal, with the environment of ``rosz env``."""

from __future__ import annotations

import os
import pty
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from network import TIMEOUT, Network

__all__ = ("COURSE", "Desk", "Terminal", "without_times")

COURSE = Path(__file__).parent
"""Where the course lies."""
_PROMPT = "\x1d$ "
_DECORATION = re.compile(r"\x1b\][^\a]*\a|\x1b\[[\d;?]*[a-zA-Z]|\r")
_TIMES = re.compile(r"\[\d{9,}\.\d+\]")
_PIDS = re.compile(r"pid \[\d+\]")
_RUN_IDS = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
_END = 30.0


def without_times(text: str) -> str:
    """Return output without times, process ids and ids of runs, of which no two are the same."""
    text = _TIMES.sub("[TIME]", text)
    return _RUN_IDS.sub("RUN", _PIDS.sub("pid [PID]", text))


class Terminal:
    """A shell that lines are typed into.

    Args:
        variables: Its environment.
        folder: Where it starts.
    """

    def __init__(self, variables: dict[str, str], folder: Path) -> None:
        self._changed = threading.Condition()
        self._text = ""
        self._taken = 0
        ours, theirs = pty.openpty()
        self._file = ours
        self._shell = subprocess.Popen(
            ["setsid", "--ctty", "bash", "--norc", "--noprofile", "--noediting", "-i"],
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            cwd=folder,
            env={**variables, "PS1": _PROMPT, "TERM": "dumb", "HISTFILE": ""},
        )
        os.close(theirs)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.start("stty -echo cols 240")
        self._until(lambda: self._text.count(_PROMPT) >= 2, "no prompt")
        self._taken = len(self._text)
        self.type('eval "$(rosz env)"')

    def _read(self) -> None:
        while True:
            try:
                data = os.read(self._file, 65536)
            except OSError:  # the other side is closed
                data = b""
            if not data:
                break
            with self._changed:
                self._text += _DECORATION.sub("", data.decode(errors="replace"))
                self._changed.notify_all()

    def _until(self, condition: Callable[[], bool], what: str, timeout: float = TIMEOUT) -> None:
        deadline = time.monotonic() + timeout
        with self._changed:
            while not condition():
                left = deadline - time.monotonic()
                if left <= 0 or not self._changed.wait(left):
                    pytest.fail(f"{what}: not within {timeout:g} s, only\n{self._text}")

    def start(self, line: str) -> None:
        """Type a line, and leave what it starts running."""
        os.write(self._file, f"{line}\n".encode())

    def type(self, line: str, timeout: float = TIMEOUT) -> str:
        """Type a line, wait for the next prompt, and return what came in between."""
        self.start(line)
        return self.prompt(line, timeout)

    def prompt(self, what: str = "the prompt", timeout: float = TIMEOUT) -> str:
        """Wait for the next prompt, and return what came before it."""
        self._until(lambda: _PROMPT in self._text[self._taken :], what, timeout)
        end = self._text.index(_PROMPT, self._taken)
        output = self._text[self._taken : end]
        self._taken = end + len(_PROMPT)
        return output

    def wait_for(self, text: str, times: int = 1, timeout: float = TIMEOUT) -> str:
        """Wait until what runs has written a text so many times; return all it wrote so far."""

        def written() -> bool:
            return self._text[self._taken :].count(text) >= times

        self._until(written, f"'{text}' {times} times", timeout)
        return self._text[self._taken :]

    def interrupt(self) -> str:
        """Press Ctrl-C, wait for the prompt, and return all that the program wrote."""
        os.write(self._file, b"\x03")
        return self.prompt("an end after Ctrl-C")

    def close(self) -> None:
        """End what runs, by Ctrl-C where that helps, and the shell."""
        os.write(self._file, b"\x03")
        deadline = time.monotonic() + _END
        with self._changed:
            while not self._text.endswith(_PROMPT) and time.monotonic() < deadline:
                self._changed.wait(0.1)
        for child in _session(self._shell.pid):
            try:
                os.kill(child, signal.SIGKILL)
            except ProcessLookupError:
                continue
        self._shell.wait()
        self._reader.join(_END)
        os.close(self._file)


def _session(leader: int) -> list[int]:
    """Return the processes of a session, its leader among them."""
    found = subprocess.run(
        ["ps", "-o", "pid=", "--sid", str(leader)], capture_output=True, text=True, check=False
    )
    return [int(pid) for pid in found.stdout.split()]


class Desk:
    """What a student sits at: a home folder with a workspace, and terminals.

    Args:
        network: Where all of it is.

    Attributes:
        course: Where the course's own packages lie.
        home: The home folder.
        workspace: The catkin workspace in it.
    """

    def __init__(self, network: Network) -> None:
        self._terminals: list[Terminal] = []
        self.course = COURSE
        self.home = network.folder
        self.workspace = self.home / "catkin_ws"
        (self.workspace / "src").mkdir(parents=True)
        programs = self.home / "bin"
        programs.mkdir()
        self._program(programs / "rosz", f'exec {sys.executable} -m rosz "$@"')
        self._program(programs / "python", f'exec {sys.executable} "$@"')
        self.variables = network.variables(PATH=f"{programs}:/usr/bin:/bin", LANG="C.UTF-8")
        for unlike in ("PYTHONWARNINGS", "PYTHONUNBUFFERED"):
            del self.variables[unlike]

    def _program(self, path: Path, line: str) -> None:
        path.write_text(f"#!/bin/sh\n{line}\n")
        path.chmod(0o755)

    def add(self, *packages: str) -> None:
        """Put packages of the course into the workspace."""
        for package in packages:
            source = COURSE / "src" / package
            if source.is_dir():
                shutil.copytree(source, self.workspace / "src" / package)
            else:
                shutil.copy(source, self.workspace / "src" / package)

    def add_pub_sub(self, version: int) -> None:
        """Put a version of pub_sub in place of the one before."""
        target = self.workspace / "src" / "pub_sub"
        shutil.rmtree(target, ignore_errors=True)
        shutil.copytree(COURSE / "pub_sub" / f"v{version}", target)

    def terminal(self, folder: Path | None = None) -> Terminal:
        """Open a terminal in the workspace, or in another folder."""
        made = Terminal(self.variables, folder or self.workspace)
        self._terminals.append(made)
        return made

    def close(self) -> None:
        """Close all terminals."""
        while self._terminals:
            self._terminals.pop().close()
