"""The input of a launch besides its files: the command line, and the system around it.

Everything else in this package is pure. It reaches files, packages and commands through a
`LaunchContext`, so tests can replace them; `SystemContext` is the context of this process.
"""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Protocol

import msgspec

from rosz.errors import LaunchError
from rosz.packages import PackageIndex, start_words

_ASSIGNMENT = re.compile(r"(?:[~/A-Za-z]|_|__)[\w/]*:=.*")
_NAMESPACE = "__ns:="

_MAX_BYTES = 64 * 1024 * 1024
"""Largest size of a file or an output: a device or a command may produce data without end."""


class LaunchArguments(msgspec.Struct, frozen=True):
    """The parsed command line of a launch.

    Attributes:
        args: Values for ``<arg>`` by name.
        ns: Value of ``__ns``, or "" if it is not given.
        rest: Words that are not assignments: a package and files, or files.
        warnings: Warnings about words without effect, which roslaunch ignores silently.
    """

    args: dict[str, str] = {}
    ns: str = ""
    rest: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def parse_arguments(argv: Sequence[str]) -> LaunchArguments:
    """Parse a command line without options by roslaunch's rules.

    ``name:=value`` sets an arg. An empty value sets nothing, and neither does ``_name:=value``.
    """
    args: dict[str, str] = {}
    rest: list[str] = []
    warnings: list[str] = []
    ns = ""
    for argument in argv:
        name, assigns, value = (part.strip() for part in argument.partition(":="))
        if not assigns:
            rest.append(argument)
        elif argument.startswith(_NAMESPACE):
            ns = ns or value
        elif not _ASSIGNMENT.fullmatch(argument):
            warnings.append(f"'{argument}' is ignored: '{name}' is not the name of an arg")
        elif name.startswith("_"):
            if not name.startswith("__"):
                warnings.append(f"'{argument}' is ignored: it is for a node, not for a launch")
        elif ":=" in value:
            warnings.append(f"'{argument}' is ignored: it contains ':=' twice")
        elif not value:
            warnings.append(f"'{argument}' is ignored: it gives no value, so a default stays")
        else:
            args[name] = value
    return LaunchArguments(args, ns, tuple(rest), tuple(warnings))


class LaunchText(msgspec.Struct, frozen=True):
    """A launch file given as text, such as from standard input.

    Attributes:
        text: The XML.
        name: Name to show in messages.
    """

    text: str | bytes
    name: str = "<stdin>"


class LaunchContext(Protocol):
    """The system as launch files see it."""

    @property
    def environ(self) -> Mapping[str, str]:
        """Environment variables."""

    @property
    def cwd(self) -> str:
        """Absolute path of the folder that relative paths start from."""

    def read(self, path: str) -> bytes:
        """Return the content of a file.

        Raises:
            OSError: If it cannot be read.
        """

    def find(self, package: str) -> str:
        """Return the folder of a package.

        Raises:
            PackageNotFound: If there is no package of that name.
        """

    def built(self, package: str, name: str) -> str | None:
        """Return the path of an executable that a build of the package produced, or None.

        ``$(find PKG)/PATH`` prefers it to the file in the package's folder, as in catkin.
        """

    def anonymous(self, base: str) -> str:
        """Return a unique name; no two calls return the same one."""

    def run(self, command: Sequence[str]) -> bytes:
        """Run a command and return its standard output.

        Raises:
            OSError: If it cannot be started.
            LaunchError: If its exit code is not 0.
        """


class SystemContext:
    """The files, packages and commands of this machine.

    Args:
        packages: The known packages.
        environ: Environment variables.
        cwd: Folder that relative paths start from.
        anonymous: Function that makes a base name unique, for ``$(anon)``.
    """

    def __init__(
        self,
        packages: PackageIndex,
        environ: Mapping[str, str],
        cwd: Path,
        anonymous: Callable[[str], str],
    ) -> None:
        self._packages = packages
        self._anonymous = anonymous
        self.environ = environ
        self.cwd: str = str(cwd)

    def read(self, path: str) -> bytes:
        """Return the content of a file.

        Raises:
            OSError: If it cannot be read, or is not a regular file, as a pipe may never end.
        """
        file = Path(self.cwd, path)
        if file.exists() and not (file.is_file() or file.is_dir() or path == os.devnull):
            raise OSError(errno.EINVAL, "it is not a regular file", path)
        with file.open("rb") as stream:
            data = stream.read(_MAX_BYTES + 1)
        if len(data) > _MAX_BYTES:
            raise OSError(errno.EFBIG, f"too large, expected at most {_MAX_BYTES} bytes", path)
        return data

    def find(self, package: str) -> str:
        """Return the folder of a package.

        Raises:
            PackageNotFound: If there is no package of that name.
        """
        return str(self._packages.find(package).path)

    def built(self, package: str, name: str) -> str | None:
        """Return an executable in the package's install or devel space, or None."""
        folder = self._packages.find(package).path
        prefixes = [folder.parent.parent] if folder.parent.name == "share" else []
        for parent in folder.parents:
            if parent.name == "src":
                prefixes += [parent.parent / "devel", parent.parent / "install"]
        for prefix in prefixes:
            candidate = prefix / "lib" / package / name
            if candidate.is_file() and os.access(candidate, os.X_OK):
                return str(candidate)
        return None

    def anonymous(self, base: str) -> str:
        """Return a unique name."""
        return self._anonymous(base)

    def run(self, command: Sequence[str]) -> bytes:
        """Run a command in the folder and environment of the launch, with its stderr visible.

        Raises:
            OSError: If it cannot be started.
            LaunchError: If its exit code is not 0, or its output is too large.
        """
        import subprocess

        shown = " ".join(command)
        program = Path(self.cwd, command[0])
        words = (*start_words(program), *command[1:]) if program.is_file() else command
        with subprocess.Popen(
            words, stdout=subprocess.PIPE, env=dict(self.environ), cwd=self.cwd
        ) as process:
            try:
                assert process.stdout is not None  # noqa: S101  # it is a pipe
                data = process.stdout.read(_MAX_BYTES + 1)
            except BaseException:
                process.kill()
                raise
            if len(data) > _MAX_BYTES:
                process.kill()
                raise LaunchError(f"command '{shown}' writes more than {_MAX_BYTES} bytes")
        if process.returncode:
            raise LaunchError(f"command '{shown}' ended with code {process.returncode}")
        return data
