from __future__ import annotations

import errno
import logging
import os
import resource
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from io import FileIO
from pathlib import Path
from typing import Any

import pytest

from rosz.node import log_handlers
from rosz.node.clock import Clock
from rosz.node.log import NodeLog
from rosz.node.log_handlers import FileHandler, log_file_name


class Bench:
    """A logger that writes to a file only, and the problems that it reported."""

    def __init__(self, path: Path, max_bytes: int = 1000, backups: int = 2) -> None:
        self.path = path
        self.troubles: list[str] = []
        self.sink = FileHandler(path, self.troubles.append, max_bytes=max_bytes, backups=backups)
        self.sink.setFormatter(logging.Formatter("%(message)s"))

    def write(self, text: str) -> None:
        self.sink.handle(logging.LogRecord("rosout", 20, __file__, 1, text, None, None))

    def lines(self, suffix: str = "") -> list[str]:
        return Path(f"{self.path}{suffix}").read_text().splitlines()


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    bench = Bench(tmp_path / "deep" / "er" / "talker.log")
    yield bench
    bench.sink.close()


@pytest.mark.parametrize(
    ("node", "name"),
    [("/talker", "talker.log"), ("/ns/talker", "ns-talker.log"), ("/a/b/c_1", "a-b-c_1.log")],
)
def test_name_of_the_file(node: str, name: str) -> None:
    assert log_file_name(node) == name


def test_file_and_folder_come_with_the_first_record(bench: Bench) -> None:
    assert not bench.path.parent.parent.exists()
    bench.write("é")
    assert bench.path.read_bytes() == "é\n".encode()


def test_file_is_appended_to(bench: Bench) -> None:
    bench.write("one")
    bench.sink.close()
    bench.write("two")
    assert bench.lines() == ["one", "two"]


def test_full_file_is_put_aside_and_few_are_kept(bench: Bench) -> None:
    for number in range(100):
        bench.write(f"{number:03} " + "x" * 45)
    assert sorted(path.name for path in bench.path.parent.iterdir()) == [
        "talker.log",
        "talker.log.1",
        "talker.log.2",
    ]
    kept = [line[:3] for suffix in (".2", ".1", "") for line in bench.lines(suffix)]
    assert kept == [f"{number:03}" for number in range(40, 100)]
    assert all(path.stat().st_size == 1000 for path in bench.path.parent.iterdir())
    assert not bench.troubles


def test_bound_counts_bytes_and_what_was_there_before(bench: Bench) -> None:
    bench.path.parent.mkdir(parents=True)
    bench.path.write_bytes(b"x" * 990)
    bench.write("é" * 5)
    assert bench.path.read_bytes() == "ééééé\n".encode()
    bench.write("é" * 494)
    assert bench.path.stat().st_size == 1000
    bench.write("")
    assert bench.path.read_bytes() == b"\n"


def test_no_file_is_put_aside_when_none_shall_be_kept(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "talker.log", backups=0)
    for _ in range(30):
        bench.write("x" * 99)
    bench.sink.close()
    assert [path.name for path in tmp_path.iterdir()] == ["talker.log"]
    assert bench.path.stat().st_size == 1000


def test_record_beyond_the_bound_is_cut(bench: Bench) -> None:
    bench.write("é" * 10_000)
    data = bench.path.read_bytes()
    assert 990 < len(data) <= 1000
    assert data.decode().endswith("é [cut]\n")


def test_what_is_no_file_is_never_put_aside(tmp_path: Path) -> None:
    link = tmp_path / "talker.log"
    link.symlink_to("/dev/null")
    bench = Bench(link)
    for _ in range(30):
        bench.write("x" * 99)
    bench.sink.close()
    assert [path.name for path in tmp_path.iterdir()] == ["talker.log"]
    assert Path("/dev/null").is_char_device()
    assert not bench.troubles


def test_unwritable_place_is_told_once(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    bench = Bench(tmp_path / "file" / "talker.log")
    bench.write("one")
    bench.write("two")
    assert bench.troubles == [
        f"cannot write log file '{tmp_path}/file/talker.log': Not a directory;"
        " the program goes on without it"
    ]


def test_folder_that_is_removed_and_made_anew(bench: Bench) -> None:
    bench.write("one")
    bench.sink.close()
    bench.path.unlink()
    bench.path.parent.rmdir()
    bench.write("two")
    assert bench.lines() == ["two"]


def test_file_that_others_put_aside_or_remove(bench: Bench) -> None:
    """The same holds for two nodes of one name, and for a person who tidies up."""
    other = Bench(bench.path)
    bench.write("first")
    for number in range(40):
        other.write(f"{number:099}")
    bench.write("second")
    assert bench.lines()[-1] == "second"
    assert all(path.stat().st_size <= 1000 for path in bench.path.parent.iterdir())
    bench.path.unlink()
    bench.write("third")
    assert bench.lines() == ["third"]
    other.sink.close()


def test_bound_holds_for_all_who_write_together(bench: Bench) -> None:
    other = Bench(bench.path)
    for number in range(10):
        for sink in (bench, other):
            sink.write(f"{number:099}")
    assert [len(bench.lines(suffix)) for suffix in ("", ".1")] == [10, 10]
    other.sink.close()


def test_full_disk(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    class FullDisk(FileIO):
        """Takes three bytes, then no more."""

        def write(self, data: Any, /) -> int:
            if len(data) > 3:
                return super().write(data[:3])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    bench.write("before")
    with monkeypatch.context() as patch:
        patch.setattr(log_handlers, "FileIO", FullDisk)
        bench.sink.close()
        bench.write("during")
        bench.write("during")
    bench.write("after")
    assert bench.lines()[0] == "before"
    assert bench.lines()[-1] == "after"
    assert bench.troubles == [
        f"cannot write log file '{bench.path}': No space left on device;"
        " the program goes on without it"
    ]


def test_full_disk_for_real(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A limit on the size of files stands for the disk; it holds for this process only."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    log = NodeLog("/talker", clock=Clock(), log_dir=tmp_path, console_format="${message}")
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
        for _ in range(3):
            log.info("x" * 60)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)
    log.info("after")
    log.close()
    out, err = capsys.readouterr()
    assert out.count("\n") == 4
    assert err == (
        f"cannot write log file '{tmp_path}/talker.log': File too large;"
        " the program goes on without it\n"
    )
    assert (tmp_path / "talker.log").read_text().endswith("after\n")


def test_threads_write_whole_lines(bench: Bench) -> None:
    def work(name: str) -> None:
        for number in range(10):
            bench.write(f"{name * 10}{number}")

    threads = [threading.Thread(target=work, args=(name,)) for name in "abcd"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    lines = bench.lines()
    assert sorted(lines) == [f"{name * 10}{number}" for name in "abcd" for number in range(10)]


def test_killed_process_has_logged_all(tmp_path: Path) -> None:
    program = (
        "import os, pathlib, signal, sys\n"
        "from rosz.node.clock import Clock\n"
        "from rosz.node.log import NodeLog\n"
        "log = NodeLog('/talker', clock=Clock(), log_dir=pathlib.Path(sys.argv[1]))\n"
        "log.info('last words')\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, tmp_path], check=False, capture_output=True, timeout=50
    )
    assert done.returncode == -signal.SIGKILL
    assert done.stdout.endswith(b"]: last words\n")
    assert (tmp_path / "talker.log").read_text().endswith(": last words\n")
