"""Bags as pages use them: those of one folder, a recording, and a bag that plays.

Recording and playing are processes of their own, and belong to the process of the page, not to a
browser: a closed browser ends neither, and all browsers see the same.
"""

from __future__ import annotations

import io
import os
import re
import shutil
import subprocess
import sys
import tarfile
import threading
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final, cast

import msgspec

from rosz.access import PagePolicy
from rosz.bags import Summary, summarize
from rosz.errors import BagError, NotFoundError, UsageError
from rosz.web.model.bag_orders import BagCommand, BagOrder, BagReport, PlayOrder, RecordOrder
from rosz.worker import Worker

COMPRESSIONS: Final = {".mcap": ("none", "zstd", "lz4"), ".bag": ("none", "bz2", "lz4")}
"""The compressions of each format of a recording, by its suffix."""
_SUFFIXES = (".mcap", ".bag", ".db3", ".active")
_ACTIVE = ".active"
_METADATA = "metadata.yaml"
_NAME = re.compile(r"[^/\\\0.][^/\\\0]*")
_MOST_LINES = 20
_START_SECONDS = 60.0
_STOP_SECONDS = 10.0
_SILENT_SECONDS = 10.0
"""Seconds without a report, after which none is expected; several come in a second."""
_FINISH_SECONDS = 60.0
"""The same after it was told to stop: a large bag on a slow disk takes a while to finish."""
_PIECE = 1 << 18


class BagRow(msgspec.Struct, frozen=True):
    """A bag in the folder.

    Attributes:
        name: Name of the file, or of the folder of a bag of rosbag2.
        size: Bytes.
        changed: Time of its last change, in seconds since 1970.
        finished: Whether it has an end; one that is being recorded has none.
    """

    name: str
    size: int
    changed: float
    finished: bool


class BagFolder:
    """The bags of one folder. Nothing else is reachable by it, and no link is followed.

    Attributes:
        path: The folder, absolute.
    """

    def __init__(self, path: Path) -> None:
        self.path: Path = path.resolve()

    def rows(self) -> list[BagRow]:
        """Return the bags, the newest first.

        Raises:
            BagError: The folder cannot be read.
        """
        try:
            with os.scandir(self.path) as entries:
                listing = [row for entry in entries if (row := _row(entry))]
        except OSError as error:
            raise BagError(f"cannot read the folder: {error.strerror}", str(self.path)) from error
        return sorted(listing, key=lambda row: (-row.changed, row.name))

    def find(self, name: str) -> Path:
        """Return the path of a bag.

        Raises:
            NotFoundError: The folder has no such bag.
        """
        if not any(row.name == name for row in self.rows()):
            raise NotFoundError(f"folder '{self.path}' has no bag '{name}'")
        return self.path / name

    def summary(self, name: str) -> tuple[Summary, list[str]]:
        """Return the summary of a bag, and its problems.

        Raises:
            NotFoundError: The folder has no such bag.
            BagError: The bag cannot be read.
            UsageError: The library for its compression is not installed.
        """
        from rosz.bags import open_reader

        path = self.find(name)
        with open_reader(path) as reader:
            return summarize(name, reader), [str(problem) for problem in reader.problems]


def _row(entry: os.DirEntry[str]) -> BagRow | None:
    """Return the bag that an entry of a folder is; None if it is none."""
    try:
        if entry.is_dir(follow_symlinks=False):
            if not _is_plain(Path(entry.path, _METADATA)):
                return None
            files = [file for file in Path(entry.path).iterdir() if _is_plain(file)]
            size = sum(file.stat().st_size for file in files)
            return BagRow(entry.name, size, entry.stat(follow_symlinks=False).st_mtime, True)
        if not entry.is_file(follow_symlinks=False) or not entry.name.endswith(_SUFFIXES):
            return None
        about = entry.stat(follow_symlinks=False)
    except FileNotFoundError:
        return None  # it was deleted meanwhile
    finished = not entry.name.endswith(_ACTIVE)
    return BagRow(entry.name, about.st_size, about.st_mtime, finished)


def _is_plain(path: Path) -> bool:
    return path.is_file() and not path.is_symlink()


def _archive(path: Path) -> Iterator[bytes]:
    """Yield a bag of rosbag2 as a tar archive, in pieces."""
    for file in sorted(child for child in path.iterdir() if _is_plain(child)):
        with file.open("rb") as opened:
            info = tarfile.TarInfo(f"{path.name}/{file.name}")
            about = os.fstat(opened.fileno())
            info.size, info.mtime = about.st_size, int(about.st_mtime)
            yield info.tobuf()
            left = info.size
            while left:
                wanted = min(left, _PIECE)
                yield opened.read(wanted).ljust(wanted, b"\0")  # padded if it was cut meanwhile
                left -= wanted
            yield bytes(-info.size % tarfile.BLOCKSIZE)
    yield bytes(2 * tarfile.BLOCKSIZE)


class BagRun:
    """A process that records or plays, until it ends or is closed.

    Args:
        order: Its options.
        folder: Its working directory.
        starter: What starts it: the process has the priority of its thread.

    Attributes:
        last: Its newest report.
        lines: Its last lines of output.
        fault: Why it failed; empty if it did not.
        bytes_per_second: Bytes recorded per second.
        messages_per_second: Messages per second.
    """

    def __init__(self, order: BagOrder, folder: Path, starter: Executor) -> None:
        self.order: BagOrder = order
        self.last: BagReport = BagReport()
        self.lines: deque[str] = deque(maxlen=_MOST_LINES)
        self.fault: str = ""
        self.bytes_per_second: float = 0.0
        self.messages_per_second: float = 0.0
        self._heard = time.monotonic()
        self._stopping = False
        self._before = BagReport()
        self._ended = threading.Event()
        self._lock = threading.Lock()
        try:
            self._process = process = starter.submit(
                subprocess.Popen,
                [sys.executable, "-m", "rosz.web.bag_process"],
                cwd=folder,
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                start_new_session=True,  # Ctrl-C goes to the page, which ends it
            ).result(_START_SECONDS)
        except OSError as error:
            raise BagError(f"cannot start its process: {error.strerror}", str(folder)) from error
        self._commands = cast("io.FileIO", process.stdin)
        self._reports = io.BufferedReader(cast("io.FileIO", process.stdout))
        self._send(order)
        self._worker: Worker[bytes] = Worker("rosz-web-bag", self._receive, receive=self._next_line)

    @property
    def ended(self) -> bool:
        """Whether it has ended."""
        return self._ended.is_set()

    @property
    def silent(self) -> bool:
        """Whether its process has stopped reporting, as after SIGSTOP."""
        limit = _FINISH_SECONDS if self._stopping else _SILENT_SECONDS
        return time.monotonic() - self._heard > limit and not self.ended

    def _send(self, line: Any) -> None:
        try:
            with self._lock:
                self._commands.write(msgspec.json.encode(line) + b"\n")
        except (BrokenPipeError, ValueError):
            return  # it has ended; `fault` says why

    def _next_line(self) -> bytes | None:
        line = self._reports.readline()
        if line:
            return line
        code = self._process.wait()
        self._reports.close()
        with self._lock:
            self._commands.close()
        if code and not self.fault:
            self.fault = f"its process ended with code {code}"
        self._ended.set()
        return None

    def _receive(self, line: bytes) -> None:
        report = msgspec.json.decode(line, type=BagReport)
        self._heard = time.monotonic()
        if report.said:
            self.lines.append(report.said)
        elif report.fault:
            self.fault = report.fault
        else:
            self._measure(report)
            self.last = report

    def _measure(self, report: BagReport) -> None:
        elapsed = report.seconds - self._before.seconds
        if elapsed >= 1 or elapsed < 0:
            self.bytes_per_second = max(0.0, (report.size - self._before.size) / elapsed)
            messages = report.messages - self._before.messages
            self.messages_per_second = max(0.0, messages / elapsed)
            self._before = report

    def control(self, command: BagCommand) -> None:
        """Control it. One that is silent is killed when it shall stop."""
        if command.do == "stop" and self.silent:
            self.fault = (
                f"its process did not respond for {_SILENT_SECONDS:g} s and was killed; what it"
                " recorded is in its .active file, which 'rosz bag reindex' finishes"
                if self.order.record is not None
                else f"its process did not respond for {_SILENT_SECONDS:g} s and was killed"
            )
            self._process.kill()
        else:
            self._stopping = self._stopping or command.do == "stop"
            self._send(command)

    def wait(self, seconds: float) -> bool:
        """Wait until it has ended; return whether it has."""
        return self._ended.wait(seconds)

    def close(self) -> None:
        """Stop it. A recorder that still writes goes on until its bag is whole."""
        if self.ended:
            return
        self._send(BagCommand("stop"))
        with self._lock:
            self._commands.close()
        if not self.wait(_STOP_SECONDS) and self.order.play is not None:
            self._process.kill()
        self._worker.close()


class Bags:
    """The bags of a folder, one recording, and one bag that plays.

    Args:
        folder: The folder.
        permission: The changes that pages may make.

    Attributes:
        folder: The bags.
        recording: The recording, also after its end; None before the first one.
        playing: The same of playing.
    """

    def __init__(self, folder: Path, permission: PagePolicy) -> None:
        self.folder: BagFolder = BagFolder(folder)
        self.recording: BagRun | None = None
        self.playing: BagRun | None = None
        self._permission = permission
        self._lock = threading.Lock()
        # Its thread begins here: one of the server's threads would have their low priority.
        self._starter = ThreadPoolExecutor(1, "rosz-web-bags")
        self._starter.submit(threading.get_ident)

    def record(self, order: RecordOrder) -> None:
        """Begin to record into a bag of the folder; the time is its name if it has none.

        Raises:
            UsageError: The page may not record, the name is not valid, or a recording is running.
            BagError: The process cannot be started.
        """
        self._permission.check_control("record bags")
        self._permission.check_topics("subscribe", order.topics)
        name = order.name or time.strftime("%Y-%m-%d-%H-%M-%S.mcap")
        if not _NAME.fullmatch(name) or Path(name).suffix not in COMPRESSIONS:
            raise UsageError(
                f"'{order.name}' is not the name of a bag in this folder; expected NAME.mcap or"
                " NAME.bag, without '/'"
            )
        order = msgspec.structs.replace(order, name=name)
        with self._lock:
            if self.recording is not None and not self.recording.ended:
                raise UsageError(f"a recording goes on: {self.recording.last.path}; stop it first")
            self.recording = BagRun(BagOrder(record=order), self.folder.path, self._starter)

    def play(self, order: PlayOrder) -> None:
        """Begin to play a bag in place of the one that plays.

        Raises:
            UsageError: The page may not publish one of its topics.
            NotFoundError: The folder has no such bag.
            BagError: The bag cannot be read, or the process not be started.
        """
        summary, _ = self.folder.summary(order.name)
        for topic in order.topics or [entry.topic for entry in summary.topics]:
            self._permission.check("publish", order.prefix + topic)
        with self._lock:
            if self.playing is not None:
                self.playing.close()
            self.playing = BagRun(BagOrder(play=order), self.folder.path, self._starter)

    def control(self, command: BagCommand) -> None:
        """Control the bag that plays.

        Raises:
            UsageError: The page may not, or none plays.
        """
        self._permission.check_read_only("play bags")
        playing = self.playing
        if playing is None or playing.ended:
            raise UsageError("no bag plays; it may have come to its end")
        playing.control(command)

    def stop_recording(self) -> None:
        """End the recording.

        Raises:
            UsageError: The page may not.
        """
        self._permission.check_control("record bags")
        if self.recording is not None:
            self.recording.control(BagCommand("stop"))

    def delete(self, name: str) -> bool:
        """Delete a bag, and return True.

        Raises:
            UsageError: The page may not, or the bag is being recorded.
            NotFoundError: The folder has no such bag.
            BagError: It cannot be deleted.
        """
        self._permission.check_control("delete bags")
        recording = self.recording
        active = None if recording is None or recording.ended else recording.last.path + _ACTIVE
        if name == active:
            raise UsageError(f"'{name}' is being recorded; stop that first")
        path = self.folder.find(name)
        try:
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink()
        except OSError as error:
            raise BagError(f"cannot delete it: {error.strerror}", str(path)) from error
        return True

    def open(self, name: str) -> tuple[Path, Iterator[bytes] | None]:
        """Return the file of a bag for a download; also its archive if it is a folder.

        Raises:
            NotFoundError: The folder has no such bag.
            UsageError: The bag has no end yet, or the page may not subscribe to one of its topics.
            BagError: The bag cannot be read.
        """
        path = self.folder.find(name)
        if self._permission.permit is not None:
            topics = [entry.topic for entry in self.folder.summary(name)[0].topics]
            self._permission.check_topics("subscribe", topics)
        if name.endswith(_ACTIVE):
            raise UsageError(
                f"'{name}' is not finished; stop its recorder, or finish it by 'rosz bag reindex'"
            )
        return path, _archive(path) if path.is_dir() else None

    def close(self) -> None:
        """End the recording and what plays."""
        for run in (self.playing, self.recording):
            if run is not None:
                run.close()
