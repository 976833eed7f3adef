"""The same programs on real ROS 1 and on rosz, and a script of a user beside them."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from network import TIMEOUT, Network, Program
from ros1.programs.runners import Ros

__all__ = ("REAL_TIMEOUT", "RealSide", "RoszSide", "run_script")

REAL_TIMEOUT = 2 * TIMEOUT
_LIBRARIES = Path("/usr/lib")


class RealSide:
    """Debian's programs with a roscore.

    Args:
        ros: The roscore.
    """

    def __init__(self, ros: Ros) -> None:
        self.variables = ros.variables()

    def command(self, package: str, program: str) -> list[str]:
        """Return the words that start a program of a package."""
        return [str(_LIBRARIES / package / program)]

    def script(self) -> list[str]:
        """Return the words that start a script."""
        return ["/usr/bin/python3"]


class RoszSide:
    """The programs of rosz.

    Args:
        network: The network.
    """

    def __init__(self, network: Network) -> None:
        self.variables = network.variables()
        for name in ("PYTHONWARNINGS", "PYTHONFAULTHANDLER"):
            del self.variables[name]

    def command(self, package: str, program: str) -> list[str]:
        """Return the words that start a program of a package."""
        return [sys.executable, "-P", "-m", "rosz", "run", package, program]

    def script(self) -> list[str]:
        """Return the words that start a script."""
        return [sys.executable, "-P", "-m", "rosz.ros1"]


@contextmanager
def _running(side: RealSide | RoszSide, commands: Sequence[Sequence[str]]) -> Iterator[None]:
    programs: list[Program] = []
    try:
        for package, program, *words in commands:
            programs.append(Program([*side.command(package, program), *words], side.variables))
        yield
    finally:
        for each in programs:
            each.close()


def run_script(
    side: RealSide | RoszSide, folder: Path, text: str, *commands: Sequence[str]
) -> list[str]:
    """Run a script beside some programs, and return its lines.

    Args:
        side: Real ROS 1 or rosz.
        folder: Folder for the script.
        text: The script, for rospy.
        commands: Package, program and arguments of each program.
    """
    file = folder / f"{type(side).__name__}.py"
    file.write_text(text)
    with _running(side, commands):
        user = Program([*side.script(), str(file)], side.variables, folder)
        try:
            assert user.exit_code(REAL_TIMEOUT) == 0, user.output
            return user.lines
        finally:
            user.close()
