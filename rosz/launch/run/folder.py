"""The folder of one run: where its nodes keep their logs, and the launch its own."""

from __future__ import annotations

import faulthandler
import os
import time
from pathlib import Path
from typing import TextIO

from rosz.errors import LaunchError

__all__ = ("LaunchLog", "RunFolder")


class RunFolder:
    """``<log folder>/<run id>``, to which ``latest`` beside it points.

    Args:
        log_dir: The log folder.
        run_id: Id of the run.
    """

    def __init__(self, log_dir: Path, run_id: str) -> None:
        self.path = log_dir / run_id

    def create(self) -> None:
        """Make the folder, and have ``latest`` point to it.

        Raises:
            LaunchError: It cannot be made or written to.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._point_latest()
        except OSError as error:
            raise LaunchError(
                f"cannot keep logs in '{self.path}': {error.strerror}; set ROS_LOG_DIR to a folder"
                " that can be written to"
            ) from error

    def _point_latest(self) -> None:
        latest = self.path.parent / "latest"
        if latest.exists() and not latest.is_symlink():
            return  # somebody keeps a real folder of that name
        fresh = latest.with_name(f".latest-{os.getpid()}")
        fresh.unlink(missing_ok=True)
        fresh.symlink_to(self.path.name)
        fresh.replace(latest)

    def node_log(self, label: str) -> Path:
        """Return where a process keeps its own log."""
        return self.path / f"{_file_name(label)}.log"

    def stdout_log(self, label: str) -> Path:
        """Return where the standard output of a process goes that is not shown."""
        return self.path / f"{_file_name(label)}-stdout.log"

    def pattern(self, label: str) -> str:
        """Return what matches all logs of a process, as messages name them."""
        return str(self.path / f"{_file_name(label)}*.log")


class LaunchLog:
    """The log of the launch process itself.

    Args:
        path: File to append to.

    Raises:
        OSError: It cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: TextIO | None = path.open("a", encoding="utf-8")

    def write(self, level: str, text: str) -> None:
        """Append a line; a full disk does not stop the launch."""
        if self._file is None:
            return
        try:
            self._file.write(f"[{_now()}] [{level}] {text}\n")
            self._file.flush()
        except OSError:
            self.close()

    def dump_stacks(self, reason: str) -> None:
        """Append the stacks of all threads; from a signal handler too, within another `write`."""
        if self._file is None:
            return
        fd = self._file.fileno()
        try:
            os.write(fd, f"[{_now()}] [INFO] {reason}; the stacks of all threads:\n".encode())
        except OSError:  # a full disk does not stop the launch
            return
        faulthandler.dump_traceback(fd)

    def close(self) -> None:
        """Close the file; again is no error."""
        file, self._file = self._file, None
        if file is not None:
            try:
                file.close()
            except OSError:  # what could not be flushed is lost with the disk
                return


def _now() -> str:
    return time.strftime("%Y-%m-%d %H:%M:%S")


def _file_name(label: str) -> str:
    return label.replace("/", "-")
