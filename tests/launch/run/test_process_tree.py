"""Descendants are found by their tag, also outside their process group."""

from __future__ import annotations

import os
import secrets
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from network import eventually

from rosz.launch.run.process_tree import ProcessTree, Usage, group_alive

from .in_thread import alive


@pytest.fixture
def tag() -> str:
    return secrets.token_hex(8)


@pytest.fixture
def parent(tag: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process with a child that moved into a session of its own."""
    process = subprocess.Popen(
        ["sh", "-c", "setsid sleep 600 & echo up; wait"],
        env={**os.environ, "ROSZ_LAUNCH": f"{tag}:1"},
        stdout=subprocess.PIPE,
        start_new_session=True,
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"up\n"
        yield process
        ProcessTree(tag).kill()


def test_all_descendants_are_found(tag: str, parent: subprocess.Popen[bytes]) -> None:
    eventually(lambda: len(ProcessTree(tag).tags()) == 2, "both processes")
    assert parent.pid in ProcessTree(tag).tags()
    # The child shows no environment in the instant in which it becomes another program.
    eventually(lambda: ProcessTree(f"{tag}:1").tags() == ProcessTree(tag).tags(), "one answer")
    assert ProcessTree(f"{tag}:11").tags() == {}
    assert ProcessTree(tag[:-1]).tags() == {}
    assert set(ProcessTree(tag).tags().values()) == {f"{tag}:1"}


def test_all_descendants_are_killed(tag: str, parent: subprocess.Popen[bytes]) -> None:
    eventually(lambda: len(ProcessTree(tag).tags()) == 2, "both processes")
    pids = list(ProcessTree(tag).tags())
    ProcessTree(tag).kill()
    parent.wait(60)
    eventually(lambda: not any(map(alive, pids)), "end of both")


def test_a_process_that_executes_another_program_is_killed(
    tag: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with subprocess.Popen(["sleep", "600"]) as changing:
        entry = tmp_path / str(changing.pid)
        entry.mkdir()
        (entry / "environ").write_bytes(b"")
        (entry / "stat").write_text(Path(f"/proc/{changing.pid}/stat").read_text())
        monkeypatch.setattr("rosz.launch.run.process_tree._PROC", tmp_path)
        shown = f"A=1\0ROSZ_LAUNCH={tag}:1\0".encode()
        monkeypatch.setattr(time, "sleep", lambda _: (entry / "environ").write_bytes(shown))
        ProcessTree(tag).kill()
        monkeypatch.undo()
        assert changing.wait(60) == -signal.SIGKILL


def test_a_process_without_environment_does_not_delay(
    tag: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with subprocess.Popen(["sleep", "600"], env={}) as bare:
        looks: list[float] = []
        monkeypatch.setattr(time, "sleep", looks.append)
        ProcessTree(tag).kill()
        monkeypatch.undo()
        assert 1 <= len(looks) <= 20
        assert bare.poll() is None
        bare.kill()


def test_tags_of_an_inner_launch_are_below_the_outer(tag: str) -> None:
    environ = {**os.environ, "ROSZ_LAUNCH": f"{tag}:3:abc:1"}
    with subprocess.Popen(["sleep", "600"], env=environ) as inner:
        # It shows no environment in the instant in which it becomes another program.
        eventually(lambda: ProcessTree(tag).below(f"{tag}:3") == [inner.pid], "its environment")
        assert ProcessTree(tag).below(f"{tag}:3:abc") == [inner.pid]
        assert ProcessTree(tag).below(f"{tag}:1") == []
        ProcessTree(f"{tag}:3").kill()
        assert inner.wait(60) == -signal.SIGKILL


def test_usage_is_counted_by_tag(tag: str) -> None:
    environ = {**os.environ, "ROSZ_LAUNCH": f"{tag}:7"}
    script = "x = bytearray(50_000_000)\nwhile True: pass"
    with subprocess.Popen([sys.executable, "-S", "-c", script], env=environ) as busy:
        seen: dict[str, Usage] = {}

        def is_busy() -> bool:
            seen.update(ProcessTree(tag).usage())
            used = seen.get(f"{tag}:7")
            return used is not None and used.cpu > 0.05 and used.memory > 50_000_000

        eventually(is_busy, "some work")
        busy.kill()
    used = seen[f"{tag}:7"]
    assert used.processes == 1
    assert used.memory < 200_000_000


HOLDS_A_ZOMBIE = """
import os, subprocess, sys
leader = subprocess.Popen(["cat"], stdin=subprocess.PIPE, process_group=0)
zombie = subprocess.Popen(["true"], process_group=leader.pid)
os.waitid(os.P_PID, zombie.pid, os.WEXITED | os.WNOWAIT)
print(leader.pid, flush=True)
input()
leader.stdin.close()
leader.wait()
print("over", flush=True)
input()
"""


def test_a_group_of_zombies_is_not_alive() -> None:
    """The new parent of orphans may reap them late, or never."""
    with subprocess.Popen(
        [sys.executable, "-S", "-c", HOLDS_A_ZOMBIE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as holder:
        assert holder.stdin is not None
        assert holder.stdout is not None
        group = int(holder.stdout.readline())
        assert group_alive(group)
        print(file=holder.stdin, flush=True)
        assert holder.stdout.readline() == "over\n"
        os.killpg(group, 0)
        assert not group_alive(group)
        print(file=holder.stdin, flush=True)
