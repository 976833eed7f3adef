"""The scenario in two worlds: a roscore with rospy nodes, and rosz."""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from contextlib import closing, suppress
from pathlib import Path
from types import TracebackType
from typing import Self

import msgspec
from network import Program, eventually, free_port
from oracle import PYTHON, is_installed, require

from rosz.session import is_listening

__all__ = ("Outcome", "Ros1", "Rosz", "World")

_ROOT = Path(__file__).parents[3]
_NODES = Path(__file__).with_name("nodes.py")
_TIMEOUT = 200.0
_MODULES = ("rosmaster", "rostopic", "rosservice", "rosnode", "rosmsg", "rosparam", "std_srvs.srv")
_SOME = 3
"""Lines after which what goes on for ever has said enough."""
_NOTHING = "no new messages"
"""What is measured in a second in which a busy machine has linked nobody yet."""

_PACKAGE = {
    "package.xml": (
        "<package><name>demo_pkg</name><version>0.1.0</version><description>d</description>"
        '<maintainer email="a@example.org">m</maintainer><license>MIT</license></package>'
    ),
    "msg/Reading.msg": (
        "# What a sensor says.\nint32 GOOD=1\nstring UNIT=volt # always\n\nHeader header\n"
        "time taken\nfloat64[] values\nfloat32[3] noise\nstd_msgs/ColorRGBA[2] lamps\nchar c\n"
    ),
    "srv/Ask.srv": "int8 ALL=-1\nstring what\nduration within\n---\nReading[] readings\nbool ok\n",
    "param/arms.yaml": "_ns: left\nlength: 1.5\n/odd/far: {x: 1}\n---\nname: two\n",
}
"""A package of definitions and parameters that both have."""


class Outcome(msgspec.Struct, frozen=True):
    """What a command ended with."""

    code: int
    out: str
    err: str


class World:
    """Nodes, and commands about them.

    Args:
        interpreter: What runs the nodes.
        environ: Variables of all.
    """

    def __init__(self, interpreter: list[str], environ: dict[str, str]) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="rosz-"))
        self.environ = {**environ, "HOME": str(self.folder), "ROS_HOME": str(self.folder)}
        self._interpreter = interpreter
        for name, text in _PACKAGE.items():
            file = self.folder / "src" / "demo_pkg" / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        self.environ["ROS_PACKAGE_PATH"] = f"{self.folder}/src:/usr/share"
        self._programs: list[Program] = []

    def command(self, line: str) -> list[str]:
        """Return what runs a line such as ``topic list``."""
        raise NotImplementedError

    def run(self, line: str, *, interrupt: bool = False) -> Outcome:
        """Run a command to its end, or as long as it takes to say something."""
        environ = {**self.environ, "PYTHONUNBUFFERED": "1"}
        if interrupt:
            with closing(Program(self.command(line), environ, self.folder, separate=True)) as run:
                return _beginning(run)
        done = subprocess.run(
            self.command(line),
            env=environ,
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_TIMEOUT,
            check=False,
        )
        return Outcome(done.returncode, done.stdout, done.stderr)

    def start(self, *command: str) -> Program:
        """Start a program that ends with this world."""
        self._programs.append(Program(command, self.environ, self.folder, separate=True))
        return self._programs[-1]

    def __enter__(self) -> Self:
        for name in ("talker", "listener"):
            self.start(*self._interpreter, str(_NODES), name).wait_for("ready", _TIMEOUT)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        while self._programs:
            program = self._programs.pop()
            program.send(signal.SIGINT)
            with suppress(subprocess.TimeoutExpired):
                program.process.wait(_TIMEOUT)
            program.close()
        shutil.rmtree(self.folder, ignore_errors=True)


class Ros1(World):
    """ROS 1 as Debian packages it."""

    def __init__(self) -> None:
        require(*_MODULES, package="ros-base, python3-rostopic and the other commands")
        self._port = free_port()
        environ = {
            "PATH": "/usr/bin:/bin",
            "LANG": "C.UTF-8",
            "ROS_MASTER_URI": f"http://127.0.0.1:{self._port}",
            "ROS_IP": "127.0.0.1",
        }
        super().__init__([PYTHON], environ)

    @staticmethod
    def available() -> bool:
        """Return whether it is installed."""
        return is_installed(*_MODULES)

    def command(self, line: str) -> list[str]:
        group, *words = split(line)
        return [f"/usr/bin/ros{group}", *words]

    def __enter__(self) -> Self:
        self.start("/usr/bin/roscore", "-p", str(self._port))
        eventually(lambda: is_listening(f"tcp/127.0.0.1:{self._port}"), "roscore", _TIMEOUT)
        return super().__enter__()


class Rosz(World):
    """rosz, on a network of its own."""

    def __init__(self) -> None:
        environ = {
            "PATH": os.environ.get("PATH", ""),
            "LANG": "C.UTF-8",
            "PYTHONPATH": str(_ROOT),
            "PYTHONWARNINGS": "error",
        }
        super().__init__([sys.executable, "-m", "rosz.ros1"], environ)
        self.environ["ROSZ_RENDEZVOUS"] = f"unixsock-stream/{self.folder}/z.sock"

    def command(self, line: str) -> list[str]:
        return [sys.executable, "-m", "rosz", *split(line)]

    def __enter__(self) -> Self:
        super().__enter__()
        info = "node info /listener"  # a thread opens its publisher of /rosout
        eventually(lambda: "/rosout" in self.run(info).out, "its log", _TIMEOUT)
        return self


def _beginning(program: Program) -> Outcome:
    """Return the first lines of what does not end by itself; end it then or at an error."""
    assert program.process.stdin is not None
    program.process.stdin.close()

    def said() -> list[str]:
        return [line for line in program.lines if line != _NOTHING][:_SOME]

    program.wait_until(lambda: len(said()) == _SOME or program.errors, _TIMEOUT)
    program.send(signal.SIGINT)
    code = program.exit_code(_TIMEOUT)
    out, err = ("".join(f"{line}\n" for line in lines) for lines in (said(), program.errors))
    return Outcome(code, out, err)


def split(line: str) -> list[str]:
    """Return the words of a line; what stands in braces is one."""
    return shlex.split(line.replace("{", "'{").replace("}", "}'")) if "{" in line else line.split()
