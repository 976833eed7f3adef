"""Programs run together: on real rospy with a real roscore, and on rosz."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import IO, NamedTuple
from xmlrpc.client import ServerProxy

import pytest
from network import Network, eventually

from .likeness import likeness
from .scenarios import Part, Scenario

__all__ = ("Outcome", "Ros", "Rosz")

SCRIPTS = Path(__file__).parent / "scripts"
PACKAGES = Path(__file__).parent / "packages"
_DEBIAN = "/usr/bin/python3"
_GENPY = Path("/usr/lib/genpy")
_PATIENCE = 25.0
_NEEDED = (
    "genpy, rospy, rosgraph_msgs, std_srvs, geometry_msgs, nav_msgs, sensor_msgs, diagnostic_msgs,"
    " roscpp.srv, numpy"
)


class Outcome(NamedTuple):
    """How a program ended, without what no two runs share."""

    stdout: str
    stderr: str
    code: int


class _Actor:
    """A running program, with what it writes to each of its streams."""

    def __init__(self, command: Sequence[str], variables: dict[str, str], folder: Path) -> None:
        self._changed = threading.Condition()
        self._texts = {"stdout": "", "stderr": ""}
        self.process = subprocess.Popen(
            command,
            env=variables,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self._readers = [self._follow("stdout"), self._follow("stderr")]

    def _follow(self, name: str) -> threading.Thread:
        stream: IO[str] = getattr(self.process, name)

        def read() -> None:
            for line in stream:
                with self._changed:
                    self._texts[name] += line
                    self._changed.notify_all()

        thread = threading.Thread(target=read, daemon=True)
        thread.start()
        return thread

    def wait_for(self, line: str) -> None:
        """Wait until it has written a line to its standard output."""

        def written() -> bool:
            ended = not self._readers[0].is_alive()
            return ended or line in self._texts["stdout"].splitlines()

        with self._changed:
            while not written():
                if not self._changed.wait(_PATIENCE):
                    break

    def outcome(self, unlike: Sequence[str]) -> Outcome:
        """Wait for its end, and return how it was, without lines that hold certain texts."""
        try:
            code = self.process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self.close()
            code = 999
        for reader in self._readers:
            reader.join(_PATIENCE)
        texts = [likeness(text, str(SCRIPTS), unlike) for text in self._texts.values()]
        return Outcome(texts[0], texts[1], code)

    def close(self) -> None:
        """Leave nothing of it behind."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        for reader in self._readers:
            reader.join(_PATIENCE)
        for stream in (self.process.stdout, self.process.stderr):
            if stream is not None:
                stream.close()


class _Stage:
    """Something to run programs on."""

    def command(self, part: Part) -> list[str]:
        """Return the command line of a program."""
        raise NotImplementedError

    def variables(self) -> dict[str, str]:
        """Return the environment of all programs."""
        raise NotImplementedError

    def play(self, scenario: Scenario, folder: Path) -> list[Outcome]:
        """Run the programs of a scenario, and return how they ended."""
        actors: list[_Actor] = []
        try:
            for part in scenario.parts:
                if part.after:
                    actors[-1].wait_for(part.after)
                variables = self.variables() | dict(part.variables)
                actors.append(_Actor(self.command(part), variables, folder))
            for part, actor in zip(scenario.parts, actors, strict=True):
                if part.interrupt_at:
                    actor.wait_for(part.interrupt_at)
                    # What the line announces begins right behind it.
                    threading.Event().wait(0.3)
                    actor.process.send_signal(part.signal)
            return [actor.outcome(scenario.unlike) for actor in actors]
        finally:
            for actor in actors:
                actor.close()


class Ros(_Stage):
    """Debian's rospy, and a roscore of its own.

    Args:
        folder: Where ROS writes.
    """

    def __init__(self, folder: Path) -> None:
        self._generated = folder / "generated"
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
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
        eventually(self._complete, "roscore", timeout=30)
        self._own = set(self._parameters())

    def command(self, part: Part) -> list[str]:
        """Return the command line for the system's Python."""
        return [_DEBIAN, str(SCRIPTS / part.script), *part.arguments]

    def variables(self) -> dict[str, str]:
        """Return what leads to the roscore."""
        return self._variables

    def clean(self) -> None:
        """Take away the parameters that programs have left."""
        for name in sorted(set(self._parameters()) - self._own):
            self._master.deleteParam("/test", name)

    def close(self) -> None:
        """End the roscore."""
        self._master("close")()
        os.killpg(self._core.pid, signal.SIGINT)
        try:
            self._core.wait(10)
        except subprocess.TimeoutExpired:
            os.killpg(self._core.pid, signal.SIGKILL)
            self._core.wait()

    def _require(self) -> None:
        if not Path("/usr/bin/roscore").exists():
            pytest.skip("no real ROS 1 to compare with (Debian: ros-base, python3-rospy)")
        done = subprocess.run(
            [_DEBIAN, "-c", f"import {_NEEDED}"], capture_output=True, text=True, check=False
        )
        if done.returncode:
            pytest.skip(f"ROS 1 to compare with is not whole: {done.stderr.splitlines()[-1]}")

    def _generate(self) -> None:
        """Have genpy make Python of our own packages, as catkin_make would."""
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
                    subprocess.run([_DEBIAN, generator, *options, *command], check=True)
            (target.parent / "__init__.py").touch()

    def _parameters(self) -> list[str]:
        answer = self._master.getParamNames("/test")
        assert isinstance(answer, list)
        names: list[str] = answer[2]
        return names

    def _complete(self) -> bool:
        """Tell whether the roscore has all that it brings along."""
        try:
            if self._core.poll() is not None:
                pytest.fail("roscore ended")
            answer = self._master.lookupNode("/test", "/rosout")
        except OSError:
            return False
        assert isinstance(answer, list)
        return bool(answer[0] == 1)


class Rosz(_Stage):
    """A network of its own with nothing on it.

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
        """Return what leads to the network."""
        variables = self._network.variables(ROSZ_PACKAGE_PATH=str(PACKAGES), LANG="C.UTF-8")
        for unlike in ("PYTHONWARNINGS", "PYTHONFAULTHANDLER"):
            del variables[unlike]
        return variables
