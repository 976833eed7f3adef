"""A machine: what runs on it, what it listens on, how it dies."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from textwrap import dedent
from typing import TYPE_CHECKING

from network import TIMEOUT, WHOLE_LINES, Program, eventually

from hosts.namespace import Namespace, children

if TYPE_CHECKING:
    from hosts.link import Link

__all__ = ("Host", "HostProgram")

_ROOT = Path(__file__).parents[2]


class HostProgram(Program):
    """A program on a host. Signals go to it, not to what brought it there.

    Args:
        command: What to run.
        variables: The environment.
        namespace: Where.
    """

    def __init__(
        self, command: Sequence[str], variables: dict[str, str], namespace: Namespace
    ) -> None:
        super().__init__(namespace.inside(command), variables)
        eventually(
            lambda: children(self.process.pid) or self.process.poll() is not None, "the program"
        )
        self.inner = next(iter(children(self.process.pid)), 0)

    def send(self, number: signal.Signals) -> None:
        """Send it a signal."""
        os.kill(self.inner, number)
        if number is signal.SIGCONT:  # nsenter stops along with its child
            self.process.send_signal(number)

    def kill(self) -> None:
        """End it without its doing."""
        self.send(signal.SIGKILL)
        self.process.wait(TIMEOUT)

    def close(self) -> None:
        """Leave nothing of it behind."""
        if self.process.poll() is None and self.inner:
            with suppress(ProcessLookupError):
                os.killpg(self.inner, signal.SIGKILL)
            self.process.send_signal(signal.SIGCONT)
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(TIMEOUT)
        super().close()


class Host:
    """One machine, with its own loopback, addresses, process table, name and home.

    Args:
        name: Its host name; all hosts of a world know each other by name.
        folder: For its files.

    Attributes:
        home: Home folder of its user, also by ``/etc/passwd``.
        links: Its network interfaces by the names of their networks, the first one first.
        variables: Environment of its programs; a test may change it.
    """

    def __init__(self, name: str, folder: Path) -> None:
        self.name = name
        self.home = folder / name
        (self.home / ".ssh").mkdir(parents=True, mode=0o700)
        self.home.chmod(0o700)
        self.namespace = Namespace()
        self.links: dict[str, Link] = {}
        self._programs: list[HostProgram] = []
        self._dress(folder)
        self.variables = {
            "PATH": f"{Path(sys.executable).parent}:{os.environ.get('PATH', '')}",
            "HOME": str(self.home),
            "USER": "root",
            "LANG": "C.UTF-8",
            "PYTHONPATH": str(_ROOT),
            "PYTHONUNBUFFERED": "1",
            "PYTHONFAULTHANDLER": "1",
            "PYTHONWARNINGS": "error",
        }

    def _dress(self, folder: Path) -> None:
        """Give it files of its own in place of the machine's."""
        run = self.namespace.run
        run("hostname", self.name)
        accounts = Path("/etc/passwd").read_text().splitlines(keepends=True)
        mine = f"root:x:0:0:root:{self.home}:/bin/bash\n"
        passwd = self.home / ".passwd"
        passwd.write_text(mine + "".join(line for line in accounts if line[:5] != "root:"))
        run("mount", "--bind", str(passwd), "/etc/passwd")
        run("mount", "--bind", str(folder / "hosts"), "/etc/hosts")
        run("mount", "-t", "tmpfs", "tmpfs", "/run")

    @property
    def link(self) -> Link:
        """Its only, or first, network interface."""
        return next(iter(self.links.values()))

    @property
    def address(self) -> str:
        """Its only, or first, address."""
        return self.link.address

    def execute(self, *command: str, **variables: str) -> HostProgram:
        """Start a program."""
        return self._keep(HostProgram(command, self.variables | variables, self.namespace))

    def program(self, script: str, *argv: str, **variables: str) -> HostProgram:
        """Start a Python program, given as its text."""
        return self.execute(sys.executable, "-c", WHOLE_LINES + dedent(script), *argv, **variables)

    def rosz(self, *argv: str, **variables: str) -> HostProgram:
        """Start a ``rosz`` command."""
        return self.execute(sys.executable, "-m", "rosz", *argv, **variables)

    def ask(self, *argv: str, **variables: str) -> str:
        """Run a ``rosz`` command that must succeed, and return its output."""
        program = self.rosz(*argv, **variables)
        code = program.exit_code()
        assert code == 0, f"rosz {' '.join(argv)}: exit code {code}\n{program.output}"
        return program.output

    def lists(self, node: str) -> bool:
        """Tell whether ``rosz node list`` shows a node; it fails where a link is not up yet."""
        program = self.rosz("node", "list")
        program.exit_code()
        return node in program.lines

    def run(self, *command: str) -> str:
        """Run a command of the system that must succeed, and return its output."""
        return self.namespace.run(*command)

    def processes(self) -> list[str]:
        """Return the command lines of all that runs here."""
        lines = []
        for pid in self.namespace.pids():
            try:
                words = Path(f"/proc/{pid}/cmdline").read_bytes()
                ended = " Z " in Path(f"/proc/{pid}/stat").read_text()
            except OSError:  # it ended meanwhile
                continue
            if words and not ended:
                lines.append(words.replace(b"\0", b" ").decode().strip())
        return lines

    def listening(self) -> list[str]:
        """Return the addresses with ports that something listens on, beyond loopback."""
        rows = [row.split() for row in self.run("ss", "-Hlntu").splitlines()]
        return sorted(row[4] for row in rows if not row[4].startswith(("127.", "[::1]")))

    def kill(self) -> None:
        """End all that runs here at once, as a crash does; the system tells the other sides."""
        deadline = time.monotonic() + TIMEOUT
        while pids := self.namespace.pids():
            assert time.monotonic() < deadline, f"{self.name} does not end: {self.processes()}"
            for pid in pids:
                try:
                    os.kill(pid, signal.SIGKILL)
                except ProcessLookupError:
                    continue

    def power_off(self) -> None:
        """Pull the plug: all that runs here ends, and nobody gets to hear of it."""
        for link in self.links.values():
            link.cut()
        self.kill()

    def _keep(self, program: HostProgram) -> HostProgram:
        self._programs.append(program)
        return program

    def close(self) -> None:
        """Leave nothing of it behind."""
        self.kill()  # first all, as one may hold what another writes to
        while self._programs:
            self._programs.pop().close()
        self.namespace.close()
        shutil.rmtree(self.home, ignore_errors=True)
