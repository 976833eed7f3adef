"""Signals that end a launch end its nodes too."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import pytest
from network import eventually

from .in_process import launch_process
from .in_thread import alive, program, shell

SLEEPERS = [
    shell(name, "trap 'exit 0' INT; echo up; while :; do sleep 0.02; done") for name in "abc"
]
STUBBORN = program(
    "mule",
    sys.executable,
    "-S",
    "-c",
    "import signal, time\n"
    "for s in (signal.SIGINT, signal.SIGTERM): signal.signal(s, signal.SIG_IGN)\n"
    "print('up', flush=True)\n"
    "time.sleep(600)\n",
    output="screen",
)
PATIENT = '{"timeouts": {"sigint": 3600}}'
"""Options with which nodes that ignore SIGINT hold up the launch for longer than a test waits."""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_all_nodes(tmp_path: Path, number: int) -> None:
    options = PATIENT.replace("{", '{"screen": true, ', 1)
    with launch_process(tmp_path, *SLEEPERS, options=options) as run:
        run.expect(r"c-3\]: started with pid")
        run.expect(r"(up\n(.*\n)*){3}")
        run.process.send_signal(number)
        assert run.finish() == 0
    assert not any(map(alive, run.pids()))
    assert run.text.endswith("done\n")


def test_a_second_signal_kills(tmp_path: Path) -> None:
    with launch_process(tmp_path, STUBBORN, options=PATIENT) as run:
        run.expect("up\n")
        run.process.send_signal(signal.SIGINT)
        run.expect("killing on exit")
        run.process.send_signal(signal.SIGINT)
        assert run.finish() == 0
    assert not any(map(alive, run.pids()))
    (log,) = (tmp_path / "log/latest").glob("roslaunch-*.log")
    assert "the stacks of all threads:\n" in log.read_text()
    assert "most recent call first" in log.read_text()


@pytest.mark.parametrize("asked_before", [False, True])
def test_sigquit_kills_at_once(tmp_path: Path, *, asked_before: bool) -> None:
    with launch_process(tmp_path, STUBBORN, *SLEEPERS, options=PATIENT) as run:
        run.expect(r"c-4\]: started with pid")
        run.expect("up\n")
        if asked_before:
            run.process.send_signal(signal.SIGINT)
            run.expect("killing on exit")
        run.process.send_signal(signal.SIGQUIT)
        assert run.finish() == 0
    assert not any(map(alive, run.pids()))
    (log,) = (tmp_path / "log/latest").glob("roslaunch-*.log")
    assert "the stacks of all threads:\n" in log.read_text()


def test_the_terminal_s_quit_key_leaves_no_node(tmp_path: Path) -> None:
    prefix = ("setsid", "-c", "-w")
    with launch_process(tmp_path, *SLEEPERS, terminal=True, prefix=prefix) as run:
        run.expect(r"process\[c-3\]: started with pid \[\d+\]")
        os.write(run._reading, b"\x1c")
        assert run.finish() == 0
    assert not any(map(alive, run.pids()))


def test_a_closed_terminal_ends_all(tmp_path: Path) -> None:
    # setsid -c makes the terminal the controlling one, so that closing it hangs the launch up.
    with launch_process(tmp_path, *SLEEPERS, terminal=True, prefix=("setsid", "-c", "-w")) as run:
        run.expect(r"process\[c-3\]: started with pid \[\d+\]")
        os.close(run._reading)
        run._reading = os.open(os.devnull, os.O_RDONLY)
        run.process.wait(60)
    eventually(lambda: not any(map(alive, run.pids())), "end of all nodes")


def test_nohup_is_honoured(tmp_path: Path) -> None:
    with launch_process(tmp_path, *SLEEPERS, options='{"screen": true}', prefix=("nohup",)) as run:
        run.expect(r"c-3\]: started with pid")
        run.expect(r"(up\n(.*\n)*){3}")
        run.process.send_signal(signal.SIGHUP)
        run.process.send_signal(signal.SIGTERM)
        assert run.finish() == 0
        assert run.text.count("killing on exit") == 3


IN_ORDER = "trap 'sleep 0.2; echo in order; exit 0' INT; echo up; while :; do sleep 0.02; done"
LEAVES_THE_GROUP = "trap '' INT TERM; setsid sleep 600 & echo grandchild $!; echo up; wait"


def test_a_killed_launch_takes_its_nodes_along(tmp_path: Path) -> None:
    """Those that end in order may do so; no other process remains, wherever it has gone."""
    bare = "trap '' INT TERM; echo up; while :; do sleep 0.02; done"
    nodes = (
        shell("orderly", IN_ORDER),
        shell("leaving", LEAVES_THE_GROUP),
        program("bare", "env", "-i", "sh", "-c", bare),
        STUBBORN,
    )
    with launch_process(tmp_path, *nodes, options='{"screen": true}') as run:
        run.expect(r"mule-4\]: started with pid")
        run.expect(r"(up\n(.*\n)*){4}")
        pids = [*run.pids(), int(run.expect(r"grandchild (\d+)")[1])]
        assert all(map(alive, pids))
        run.process.kill()
        eventually(lambda: not any(map(alive, pids)), "the end of all nodes")
        run.process.wait()
        run.expect("in order\n")


def test_a_killed_node_is_reported_and_others_run_on(tmp_path: Path) -> None:
    with launch_process(tmp_path, *SLEEPERS, options='{"screen": true}') as run:
        run.expect(r"c-3\]: started with pid")
        run.expect(r"(up\n(.*\n)*){3}")
        first, *rest = run.pids()
        os.kill(first, signal.SIGKILL)
        run.expect(r"\[a-1\] process has died \[pid \d+, exit code -9,")
        assert all(map(alive, rest))
        run.process.send_signal(signal.SIGINT)
        assert run.finish() == 0


def test_stubborn_nodes_end_within_the_timeouts(tmp_path: Path) -> None:
    options = '{"timeouts": {"sigint": 0.5, "sigterm": 0.3}}'
    with launch_process(tmp_path, STUBBORN, options=options) as run:
        run.expect("up\n")
        begin = time.monotonic()
        run.process.send_signal(signal.SIGINT)
        assert run.finish() == 0
        assert time.monotonic() - begin >= 0.8
    assert not any(map(alive, run.pids()))


def test_an_ignored_sigint_of_the_shell_does_not_reach_nodes(tmp_path: Path) -> None:
    """A launch in the background of a script starts with SIGINT ignored, but its nodes do not."""
    script = 'trap "" INT; exec "$@"'
    node = shell("n", "echo up; exec sleep 600", output="screen")
    with launch_process(tmp_path, node, prefix=("sh", "-c", script, "sh")) as run:
        run.expect("up\n")
        run.process.send_signal(signal.SIGINT)
        assert run.finish() == 0
    assert "escalating" not in run.text
