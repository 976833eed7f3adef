"""Descendants are known by their mark, wherever they moved."""

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

from rosz.launch.run.family import Census, Usage, family, group_lives, kill_family, usage

from .scene import alive, wait_until


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
        kill_family(tag)


def test_all_descendants_are_found(tag: str, parent: subprocess.Popen[bytes]) -> None:
    wait_until(lambda: len(family(tag)) == 2, "both processes")
    assert parent.pid in family(tag)
    # The child shows no environment in the instant in which it becomes another program.
    wait_until(lambda: family(f"{tag}:1") == family(tag), "one answer")
    assert family(f"{tag}:11") == {}
    assert family(tag[:-1]) == {}
    assert set(family(tag).values()) == {f"{tag}:1"}


def test_all_descendants_are_killed(tag: str, parent: subprocess.Popen[bytes]) -> None:
    wait_until(lambda: len(family(tag)) == 2, "both processes")
    pids = list(family(tag))
    kill_family(tag)
    parent.wait(10)
    wait_until(lambda: not any(map(alive, pids)), "end of both")


def test_who_becomes_another_program_is_killed_as_well(
    tag: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with subprocess.Popen(["sleep", "600"]) as changing:
        entry = tmp_path / str(changing.pid)
        entry.mkdir()
        (entry / "environ").write_bytes(b"")
        (entry / "stat").write_text(Path(f"/proc/{changing.pid}/stat").read_text())
        monkeypatch.setattr("rosz.launch.run.family._PROC", tmp_path)
        shown = f"A=1\0ROSZ_LAUNCH={tag}:1\0".encode()
        monkeypatch.setattr(time, "sleep", lambda _: (entry / "environ").write_bytes(shown))
        kill_family(tag)
        monkeypatch.undo()
        assert changing.wait(10) == -signal.SIGKILL


def test_who_has_no_environment_holds_up_nothing(tag: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with subprocess.Popen(["sleep", "600"], env={}) as bare:
        looks: list[float] = []
        monkeypatch.setattr(time, "sleep", looks.append)
        kill_family(tag)
        monkeypatch.undo()
        assert 1 <= len(looks) <= 20
        assert bare.poll() is None
        bare.kill()


def test_marks_of_an_inner_launch_belong_to_the_outer(tag: str) -> None:
    environ = {**os.environ, "ROSZ_LAUNCH": f"{tag}:3:abc:1"}
    with subprocess.Popen(["sleep", "600"], env=environ) as inner:
        assert Census(tag).below(f"{tag}:3") == [inner.pid]
        assert Census(tag).below(f"{tag}:3:abc") == [inner.pid]
        assert Census(tag).below(f"{tag}:1") == []
        kill_family(f"{tag}:3")
        assert inner.wait(10) == -signal.SIGKILL


def test_usage_is_counted_per_mark(tag: str) -> None:
    environ = {**os.environ, "ROSZ_LAUNCH": f"{tag}:7"}
    script = "x = bytearray(50_000_000)\nwhile True: pass"
    with subprocess.Popen([sys.executable, "-S", "-c", script], env=environ) as busy:
        seen: dict[str, Usage] = {}

        def is_busy() -> bool:
            seen.update(usage(tag))
            used = seen.get(f"{tag}:7")
            return used is not None and used.cpu > 0.05 and used.memory > 50_000_000

        wait_until(is_busy, "some work")
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


def test_a_group_of_zombies_does_not_live() -> None:
    """As where whoever adopts orphans is slow to reap them, or never does."""
    with subprocess.Popen(
        [sys.executable, "-S", "-c", HOLDS_A_ZOMBIE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as holder:
        assert holder.stdin is not None
        assert holder.stdout is not None
        group = int(holder.stdout.readline())
        assert group_lives(group)
        print(file=holder.stdin, flush=True)
        assert holder.stdout.readline() == "over\n"
        os.killpg(group, 0)
        assert not group_lives(group)
        print(file=holder.stdin, flush=True)
