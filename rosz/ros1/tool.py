"""The command lines of ROS 1's tools, as their modules offer them (``rostopic.rostopicmain``).

A command runs as a program of its own, which is that of rosz; it reads ``sys.stdin`` and
writes ``sys.stdout`` of the caller, whatever those are.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Sequence


class Tool:
    """A tool of ROS 1.

    Args:
        name: Name of its command.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._command = [sys.executable, "-P", "-m", "rosz", name]

    def main(self, argv: Sequence[str] | None = None) -> None:
        """Run a command line.

        Args:
            argv: Command line with the program name; that of the process when not given.

        Raises:
            SystemExit: The command failed, or its help was asked for.
        """
        words = [str(word) for word in (sys.argv if argv is None else argv)[1:]]
        code = self._run(words)
        if code or not words or {"-h", "--help"} & set(words):
            raise SystemExit(code)

    def parts(self, words: str) -> dict[str, Callable[..., None]]:
        """Return the functions ``_<name>_cmd_<word>``, which programs call for parts of the tool.

        Args:
            words: Commands of the tool, separated by spaces.
        """
        return {f"_{self.name}_cmd_{word}": self.main for word in words.split()}

    def usage(self) -> str:
        """Return the help of the command."""
        shown = subprocess.run(
            [*self._command, "--help"], stdout=subprocess.PIPE, encoding="utf-8", check=True
        )
        return shown.stdout

    def print_usage(self) -> None:
        """Write the help of the command to stdout, and exit.

        Raises:
            SystemExit: Always; the code is 64, as ROS 1's.
        """
        sys.stdout.write(self.usage())
        raise SystemExit(64)

    def _run(self, words: Sequence[str]) -> int:
        sys.stdout.flush()
        command = [*self._command, *words]
        if "-" in words and sys.stdin is not sys.__stdin__:
            given = sys.stdin.read()
            ended = subprocess.run(
                command, input=given, stdout=subprocess.PIPE, encoding="utf-8", check=False
            )
            sys.stdout.write(ended.stdout)
            return ended.returncode
        if sys.stdout is sys.__stdout__:
            return subprocess.run(command, check=False).returncode
        with subprocess.Popen(command, stdout=subprocess.PIPE, encoding="utf-8") as process:
            for line in process.stdout or ():
                sys.stdout.write(line)
        return process.returncode
