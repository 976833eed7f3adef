"""What reading launch files needs from the world outside.

Everything else in this package is pure, so a test can stand in for the outside, and a plan can be
made for another machine than this one. `SystemContext` is the outside of this process.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Protocol

import msgspec

from rosz.errors import LaunchError
from rosz.packages import PackageIndex

__all__ = ("LaunchContext", "LaunchText", "SystemContext")

_MOST_BYTES = 64 * 1024 * 1024
"""More is no parameter and no launch file: what is read has no end, such as a device."""


class LaunchText(msgspec.Struct, frozen=True):
    """A launch file that is no file, such as standard input.

    Attributes:
        text: The XML.
        name: What to call it in messages.
    """

    text: str | bytes
    name: str = "<stdin>"


class LaunchContext(Protocol):
    """The outside, as launch files see it."""

    @property
    def environ(self) -> Mapping[str, str]:
        """Environment variables."""

    @property
    def cwd(self) -> str:
        """Absolute path that relative paths start from."""

    def read(self, path: str) -> bytes:
        """Return the content of a file.

        Raises:
            OSError: It cannot be read.
        """

    def find(self, package: str) -> str:
        """Return the folder of a package.

        Raises:
            PackageNotFound: There is none of that name.
        """

    def built(self, package: str, name: str) -> str | None:
        """Return the path of an executable that building the package made, or None.

        ``$(find PKG)/PATH`` prefers it to the file in the package's folder, as catkin has it.
        """

    def anonymous(self, base: str) -> str:
        """Make a base name unique; no two calls give the same one."""

    def run(self, command: Sequence[str]) -> bytes:
        """Run a command and return what it wrote to stdout.

        Raises:
            OSError: It cannot be started.
            LaunchError: It ended with another code than 0.
        """


class SystemContext:
    """The files, packages and commands of this machine.

    Args:
        packages: Where packages are looked up.
        environ: Environment variables.
        cwd: Folder that relative paths start from.
        anonymous: Makes a base name unique, for ``$(anon)``.
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
        self.cwd = str(cwd)

    def read(self, path: str) -> bytes:
        """Return the content of a file.

        Raises:
            OSError: It cannot be read, or is no regular file: a pipe may never end, or begin.
        """
        file = Path(self.cwd, path)
        if file.exists() and not (file.is_file() or file.is_dir() or path == os.devnull):
            raise OSError(errno.EINVAL, "it is no regular file", path)
        with file.open("rb") as stream:
            data = stream.read(_MOST_BYTES + 1)
        if len(data) > _MOST_BYTES:
            raise OSError(errno.EFBIG, f"too large, expected at most {_MOST_BYTES} bytes", path)
        return data

    def find(self, package: str) -> str:
        """Return the folder of a package.

        Raises:
            PackageNotFound: There is none of that name.
        """
        return str(self._packages.find(package).path)

    def built(self, package: str, name: str) -> str | None:
        """Return an executable of the package in the install or devel space that belongs to it."""
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
        """Make a base name unique."""
        return self._anonymous(base)

    def run(self, command: Sequence[str]) -> bytes:
        """Run a command in the folder and environment of the launch; its stderr stays visible.

        Raises:
            OSError: It cannot be started.
            LaunchError: It ended with another code than 0, or writes without end.
        """
        import subprocess

        shown = " ".join(command)
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, env=dict(self.environ), cwd=self.cwd
        ) as process:
            try:
                assert process.stdout is not None  # noqa: S101  # it is a pipe
                data = process.stdout.read(_MOST_BYTES + 1)
            except BaseException:
                process.kill()
                raise
            if len(data) > _MOST_BYTES:
                process.kill()
                raise LaunchError(f"command '{shown}' writes more than {_MOST_BYTES} bytes")
        if process.returncode:
            raise LaunchError(f"command '{shown}' ended with code {process.returncode}")
        return data
