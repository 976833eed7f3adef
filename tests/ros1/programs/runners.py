"""Runs programs together: on real rospy with a real roscore, and on rosz."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
from ast import literal_eval
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple
from xmlrpc.client import ServerProxy

import pytest
from network import TIMEOUT, Network, Program, eventually, free_port
from oracle import PYTHON, require

from .scenarios import Part, Scenario

__all__ = ("Outcome", "Ros", "Rosz")

SCRIPTS = Path(__file__).parent / "scripts"
PACKAGES = Path(__file__).parent / "packages"
_GENPY = Path("/usr/lib/genpy")
_LOOKS = 10
"""A thread that still computes is seen at it: it sleeps for the interpreter lock only."""
_NEEDED = (
    *("genpy", "rospy", "rosmaster", "rosgraph_msgs", "std_srvs", "geometry_msgs", "nav_msgs"),
    *("sensor_msgs", "diagnostic_msgs", "roscpp.srv", "numpy"),
)

_CHANGING: tuple[tuple[re.Pattern[str], str | Callable[[re.Match[str]], str]], ...] = (
    (re.compile(r"\[\d{9,}\.\d+"), "[TIME"),
    (re.compile(r"0x[0-9a-f]{6,}"), "0xADDRESS"),
    (re.compile(r"http://[\w.-]+:\d+/?"), "http://HOST:PORT/"),
    (re.compile(r"\x1b\[[\d;]*m"), ""),
    (re.compile(r"Thread-\d+"), "Thread-N"),
    (re.compile(r"the rosdep view is empty: .*\n"), ""),
    # Debug messages of the library; those of the programs begin with "my".
    (re.compile(r"(?m)^\[DEBUG\] \[TIME[^:]*: (?!my ).*\n"), ""),
    (re.compile(r"(?m)^\['Traceback .*\]$"), lambda found: _listed(found[0])),
)
_FRAME = re.compile(r'\s*File "(?P<path>[^"]+)", line \d+')
_MARKS = re.compile(r"\s+[~^]+\s*")


class Outcome(NamedTuple):
    """The normalized output and the exit code of a program."""

    stdout: str
    stderr: str
    code: int


class _Runner:
    """Base class of what runs programs."""

    def command(self, part: Part) -> list[str]:
        """Return the command line of a program."""
        raise NotImplementedError

    def variables(self) -> dict[str, str]:
        """Return the environment of all programs."""
        raise NotImplementedError

    def run(self, scenario: Scenario, folder: Path) -> list[Outcome]:
        """Run the programs of a scenario."""
        running: list[Program] = []
        try:
            for part in scenario.parts:
                if part.after:
                    running[-1].wait_for(_whole(part.after), TIMEOUT)
                variables = self.variables() | dict(part.variables)
                running.append(Program(self.command(part), variables, folder, separate=True))
            for part, program in zip(scenario.parts, running, strict=True):
                if part.interrupt_at:
                    program.wait_for(_whole(part.interrupt_at), TIMEOUT)
                    if part.waits:
                        eventually(partial(_is_waiting, program.pid), "the wait", TIMEOUT)
                    program.send(part.signal)
            return [_outcome(program, scenario.ignored) for program in running]
        finally:
            for program in running:
                program.close()


class Ros(_Runner):
    """Runs programs on Debian's rospy with a roscore.

    Args:
        folder: Folder for the files of ROS.
    """

    def __init__(self, folder: Path) -> None:
        self._generated = folder / "generated"
        port = free_port()
        self._variables = {
            "PATH": "/usr/bin:/bin",
            "HOME": str(folder),
            "ROS_HOME": str(folder),
            "ROS_IP": "127.0.0.1",
            "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
            "PYTHONPATH": str(self._generated),
            "PYTHONUNBUFFERED": "1",
            "LANG": "C.UTF-8",
        }
        self._require()
        self._generate()
        self._core = subprocess.Popen(
            ["/usr/bin/roscore", "-p", str(port)],
            env=self._variables,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        self._master = ServerProxy(self._variables["ROS_MASTER_URI"])
        try:
            eventually(self._complete, "roscore")
            self._own = set(self._parameters())
        except BaseException:  # else the roscore would stay, as an unclosed process of a later test
            self.close()
            raise

    def command(self, part: Part) -> list[str]:
        """Return the command line for Debian's Python."""
        return [PYTHON, str(SCRIPTS / part.script), *part.arguments]

    def variables(self) -> dict[str, str]:
        """Return the environment with the URI of the roscore."""
        return self._variables

    def clean(self) -> None:
        """Delete the parameters that programs have left."""
        for name in sorted(set(self._parameters()) - self._own):
            self._master.deleteParam("/test", name)

    def close(self) -> None:
        """End the roscore."""
        self._master("close")()
        if self._core.poll() is None:
            os.killpg(self._core.pid, signal.SIGINT)
        try:
            self._core.wait(60)
        except subprocess.TimeoutExpired:
            os.killpg(self._core.pid, signal.SIGKILL)
            self._core.wait()

    def _require(self) -> None:
        require(*_NEEDED, package="ros-base, python3-rospy, python3-numpy and messages")

    def _generate(self) -> None:
        """Generate Python modules of the test packages with genpy, as catkin_make does."""
        for package in PACKAGES.iterdir():
            for kind in ("msg", "srv"):
                target = self._generated / package.name / kind
                target.mkdir(parents=True)
                files = sorted(map(str, (package / kind).glob(f"*.{kind}")))
                paths = [f"-I{package.name}:{package / 'msg'}"]
                paths += [f"-Istd_msgs:{path}" for path in Path("/usr/share/std_msgs").glob("msg")]
                generator = str(_GENPY / f"gen{kind}_py.py")
                options = ["-p", package.name, "-o", str(target)]
                for command in ([*files, *paths], ["--initpy"]):
                    subprocess.run([PYTHON, generator, *options, *command], check=True)
            (target.parent / "__init__.py").touch()

    def _parameters(self) -> list[str]:
        reply = self._master.getParamNames("/test")
        assert isinstance(reply, list)
        names: list[str] = reply[2]
        return names

    def _complete(self) -> bool:
        """Return whether the roscore has started completely."""
        try:
            if self._core.poll() is not None:
                pytest.fail("roscore ended")
            reply = self._master.lookupNode("/test", "/rosout")
        except OSError:
            return False
        assert isinstance(reply, list)
        return bool(reply[0] == 1)


class Rosz(_Runner):
    """Runs programs on rosz.

    Args:
        network: The network.
    """

    def __init__(self, network: Network) -> None:
        self._network = network

    def command(self, part: Part) -> list[str]:
        """Return the command line for this Python."""
        script = str(SCRIPTS / part.script)
        return [sys.executable, "-P", "-m", "rosz.ros1", script, *part.arguments]

    def variables(self) -> dict[str, str]:
        """Return the environment of the network."""
        variables = self._network.variables(ROSZ_PACKAGE_PATH=str(PACKAGES), LANG="C.UTF-8")
        for name in ("PYTHONWARNINGS", "PYTHONFAULTHANDLER"):
            del variables[name]
        return variables


def _whole(line: str) -> re.Pattern[str]:
    return re.compile(f"^{re.escape(line)}$")


def _is_waiting(pid: int) -> bool:
    """Return whether the main thread of a process sleeps each time when looked at."""
    status = Path(f"/proc/{pid}/stat")
    pause = threading.Event()
    for _ in range(_LOOKS):
        if status.read_text().rpartition(")")[2].split()[0] != "S":
            return False
        pause.wait(0.01)
    return True


def _outcome(program: Program, ignored: Sequence[str]) -> Outcome:
    """Wait for the end of a program; remove lines that contain an ignored text."""
    code = program.exit_code(TIMEOUT)
    stdout, stderr = (
        normalize("\n".join([*lines, ""]), str(SCRIPTS), ignored)
        for lines in (program.lines, program.errors)
    )
    return Outcome(stdout, stderr, code)


def normalize(text: str, folder: str, ignored: Sequence[str] = ()) -> str:
    """Replace what differs between two runs: times, addresses, ports and frames of libraries.

    Args:
        text: Output of a program.
        folder: Folder of the programs; frames of other files are removed from tracebacks.
        ignored: Texts; lines that contain one of them are removed.
    """
    for pattern, name in _CHANGING:
        text = pattern.sub(name, text)
    lines = [line for line in text.splitlines() if not any(word in line for word in ignored)]
    return "\n".join(_own_frames(lines, folder)).strip().replace(folder, "SCRIPTS")


def _listed(text: str) -> str:
    """Return the text of a traceback that was logged as a list of lines."""
    lines: list[str] = literal_eval(text)
    return "".join(lines)


def _own_frames(lines: list[str], folder: str) -> Iterator[str]:
    """Yield lines without the frames of libraries and without marks below the other frames."""
    depth = None
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if depth is not None and indent > depth:
            continue
        depth = None
        frame = _FRAME.match(line)
        if frame and not frame["path"].startswith(folder):
            depth = indent
        elif not _MARKS.fullmatch(line):
            yield line
