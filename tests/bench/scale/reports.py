"""What the processes of a crowd tell, or leave behind when they die."""

from __future__ import annotations

import os
import select
import subprocess
import time
from collections import defaultdict
from pathlib import Path

__all__ = ("Late", "Reports", "Trouble")

_LOOK_SECONDS = 0.5
_CHUNK = 1 << 16


class Trouble(Exception):
    """A crowd is not to be measured any further."""


class Late(Trouble):
    """Something takes too long."""


class Reports:
    """One pipe that all write to, in lines of a word and a number; and a file of errors for each.

    Args:
        folder: For those files.

    Attributes:
        inlet: Where they write.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._outlet, self.inlet = os.pipe()
        self._rest = b""
        self._told: defaultdict[str, list[float]] = defaultdict(list)
        self._processes: dict[str, subprocess.Popen[bytes]] = {}

    def add(self, name: str, process: subprocess.Popen[bytes]) -> None:
        """Take note of one that must not die."""
        self._processes[name] = process

    def forget(self, name: str) -> subprocess.Popen[bytes]:
        """Return one that may die from now on."""
        return self._processes.pop(name)

    def process(self, name: str) -> subprocess.Popen[bytes]:
        """Return one of them."""
        return self._processes[name]

    def errors(self, name: str) -> Path:
        """Return the file that one of them writes its errors to."""
        return self._folder / f"{name}.err"

    def say(self, name: str, line: str) -> None:
        """Write a line to the standard input of one of them."""
        inlet = self._processes[name].stdin
        assert inlet is not None
        try:
            inlet.write(f"{line}\n".encode())
            inlet.flush()
        except BrokenPipeError:
            self._look()

    def wait_for(self, word: str, count: int, timeout: float) -> list[float]:
        """Wait until a word was said so often, and return the numbers; they count only once.

        Raises:
            Late: It was not, in so many seconds.
            Trouble: A process died.
        """
        deadline = time.monotonic() + timeout
        while len(self._told[word]) < count:
            if time.monotonic() > deadline:
                raise Late(f"over {timeout:g} s: '{word}' from {len(self._told[word])} of {count}")
            if select.select([self._outlet], [], [], _LOOK_SECONDS)[0]:
                self._take(os.read(self._outlet, _CHUNK))
            else:
                self._look()
        return self._told.pop(word)

    def _take(self, text: bytes) -> None:
        *lines, self._rest = (self._rest + text).split(b"\n")
        for line in lines:
            word, _, number = line.decode(errors="replace").partition(" ")
            self._told[word].append(_number(number))

    def _look(self) -> None:
        for name, process in self._processes.items():
            code = process.poll()
            if code is not None:
                words = self.errors(name).read_text(errors="replace").strip()
                last = words.splitlines()[-1] if words else "without a word"
                raise Trouble(f"{name} ended with code {code}: {last}")

    def close(self) -> None:
        """Hear no more."""
        os.close(self._outlet)
        os.close(self.inlet)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:  # a core tells other things
        return 0.0
