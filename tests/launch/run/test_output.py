"""The output of nodes is shown whole and in order, with or without their names."""

from __future__ import annotations

import errno
import fcntl
import os
import re
import select
import signal
import socket
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from network import Network, eventually

from rosz.launch.run.output import RelayedOutput
from rosz.launch.run.relay import OutputRelay

from .in_process import launch_process
from .in_thread import TIMEOUT, alive, launch, program, shell

CHATTER = (
    "import sys, time\n"
    "for i in range(200):\n"
    "    sys.stdout.write(sys.argv[1] * 40); sys.stdout.flush()\n"
    "    sys.stdout.write('.\\n'); sys.stdout.flush()\n"
)


def test_screen_shows_lines_as_they_are(tmp_path: Path) -> None:
    node = shell("n", "echo one; echo two >&2; printf three", output="screen")
    with launch_process(tmp_path, node) as run:
        assert run.finish() == 0
    assert "\none\ntwo\nthree" in run.text
    assert run.text.index("three") < run.text.index("[n-1] process has finished cleanly")


def test_streams_stay_apart(tmp_path: Path) -> None:
    node = shell("n", "echo one; echo two >&2", output="screen")
    with launch_process(tmp_path, node, separate=True) as run:
        assert run.finish() == 0
    assert "\none\n" in run.text
    assert "\ntwo\n" not in run.text
    assert (tmp_path / "err").read_text() == "two\n"


def test_log_goes_to_a_file_and_errors_to_the_screen(tmp_path: Path) -> None:
    with launch_process(tmp_path, shell("a/b", "echo one; echo two >&2", namespace="/ns")) as run:
        assert run.finish() == 0
    assert "\none\n" not in run.text
    assert "\ntwo\n" in run.text
    assert (tmp_path / "log/latest/ns-a-b-1-stdout.log").read_text() == "one\n"


def test_a_respawned_node_appends_to_its_file(tmp_path: Path) -> None:
    with launch_process(tmp_path, shell("n", "echo one", respawn=True, respawn_max=2)) as run:
        assert run.finish() == 0
    assert (tmp_path / "log/latest/n-1-stdout.log").read_text() == "one\none\none\n"


def test_screen_and_log_can_be_forced(tmp_path: Path) -> None:
    nodes = shell("a", "echo one"), shell("b", "echo two", output="screen")
    with launch_process(tmp_path, *nodes, options='{"screen": true}') as run:
        run.finish()
    assert "\none\n" in run.text
    with launch_process(tmp_path, *nodes, options='{"log": true}') as run:
        run.finish()
    assert "\ntwo\n" not in run.text


def test_a_prefix_names_the_node_on_each_line(tmp_path: Path) -> None:
    node = shell("n", "printf 'one\\ntwo\\n\\nlast'; echo oh >&2", output="screen")
    with launch_process(tmp_path, node, options='{"prefixed": true}') as run:
        run.finish()
    lines = [line for line in run.text.splitlines() if line.startswith("[n-1] ")]
    assert lines[:4] == ["[n-1] one", "[n-1] two", "[n-1] ", "[n-1] lastoh"]


def test_lines_of_two_nodes_are_never_mixed(tmp_path: Path) -> None:
    nodes = [program(c, sys.executable, "-S", "-c", CHATTER, c, output="screen") for c in "abcd"]
    with launch_process(tmp_path, *nodes) as run:
        assert run.finish() == 0
    for c in "abcd":
        assert len(re.findall(rf"^{c * 40}\.$", run.text, re.MULTILINE)) == 200


def test_words_of_the_launch_part_no_line(network: Network) -> None:
    """Both write to one pipe; each write beyond what it takes at once can be parted."""
    reading, writing = os.pipe()
    fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, select.PIPE_BUF)
    numbers, words = [str(number) for number in range(50_000)], ["word"] * 2000
    ours, theirs = socket.socketpair()

    def say() -> None:
        for word in words:
            os.write(writing, f"{word}\n".encode())

    with ours, theirs, os.fdopen(reading) as file, os.fdopen(writing, "w"):
        relay = OutputRelay(ours, "tag")
        data = "".join(f"{number}\n" for number in numbers).encode()
        network.thread(lambda: relay._write(writing, data))
        network.thread(say)
        lines = [file.readline().rstrip() for _ in numbers + words]
        relay.selector.close()
    assert [line for line in lines if line != "word"] == numbers


def test_an_unfinished_line_is_shown(tmp_path: Path) -> None:
    node = shell("n", "printf 'password: '; exec sleep 600", output="screen")
    with launch_process(tmp_path, node) as run:
        run.expect(r"password: $")


def test_much_output_arrives_whole(tmp_path: Path) -> None:
    node = shell("n", "seq 200000; seq 3 >&2", output="screen")
    with launch_process(tmp_path, node, separate=True) as run:
        run.expect(r"done\n$")
        assert run.finish() == 0
    numbers = [line for line in run.text.splitlines() if line.isdigit()]
    assert numbers == [str(i) for i in range(1, 200001)]


def test_a_line_without_end_does_not_fill_memory(tmp_path: Path) -> None:
    node = shell("n", "head -c 3000000 /dev/zero | tr '\\0' x", output="screen")
    with launch_process(tmp_path, node) as run:
        run.expect(r"done\n$")
        assert run.finish() == 0
    assert run.text.count("x") >= 3000000


def test_nodes_of_a_terminal_have_a_terminal(tmp_path: Path) -> None:
    script = "test -t 1 && test -t 2 && echo both are; stty size <&1; printf '\\033[32mgreen\\n'"
    with launch_process(tmp_path, shell("n", script, output="screen"), terminal=True) as run:
        run.finish()
    assert "both are\r\n" in run.text
    assert "\033[32mgreen\r\n" in run.text
    assert "\033[1mprocess[n-1]: started with pid" in run.text


def test_no_colours_without_a_terminal(tmp_path: Path) -> None:
    with launch_process(tmp_path, shell("n", "exit 3")) as run:
        run.finish()
    assert "\033" not in run.text


def test_deaths_are_red_on_a_terminal(tmp_path: Path) -> None:
    with launch_process(tmp_path, shell("n", "exit 3"), terminal=True) as run:
        run.finish()
    assert "\033[31m[n-1] process has died [pid " in run.text


def test_python_writes_at_once_where_output_is_piped(tmp_path: Path) -> None:
    script = "import time; print('early'); time.sleep(600)"
    node = program("n", sys.executable, "-S", "-c", script, output="screen")
    with launch_process(tmp_path, node) as run:
        run.expect("early\n")


def test_output_is_shown_as_nodes_end_with_a_killed_launch(tmp_path: Path) -> None:
    # What it starts as it ends is found and interrupted, too, if that is slow.
    last = "trap 'trap \"\" INT; seq 30000; echo over; exit 0' INT; echo up"
    last += "; while :; do sleep 0.05; done"
    with launch_process(tmp_path, shell("n", last, output="screen")) as run:
        run.expect("up\n")
        run.process.kill()
        run.expect("\n30000\nover\n")
        assert run.finish() == -signal.SIGKILL
        eventually(lambda: not _relays_of(run._reading), "end of the relay")


def _relays_of(pipe: int) -> list[str]:
    """Return the relays that write to a pipe."""
    name = f"pipe:[{os.fstat(pipe).st_ino}]"
    found = []
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            if b"relay.py" in (entry / "cmdline").read_bytes():
                found += [entry.name] if str((entry / "fd/1").readlink()) == name else []
    return found


def test_a_relay_is_found_while_it_runs(tmp_path: Path) -> None:
    with launch_process(tmp_path, shell("n", "echo hello; exec sleep 600", output="screen")) as run:
        run.expect(r"\nhello\n")
        assert len(_relays_of(run._reading)) == 1


@pytest.mark.parametrize("terminal", [False, True])
def test_a_relay_that_dies_is_restarted(tmp_path: Path, *, terminal: bool) -> None:
    script = "while :; do echo tick || exit 3; sleep 0.05; done"
    node = shell("n", script, output="screen", respawn=True)
    with launch_process(tmp_path, node, shell("m", "exec sleep 600"), terminal=terminal) as run:
        run.expect(r"tick\r?\n")
        relay = _relay_below(run.process.pid)
        eventually(lambda: _age(relay) > 1.5, "some life")
        os.kill(relay, signal.SIGKILL)
        run.expect(
            rf"the relay of the nodes' output \(pid {relay}\) has died \(-9\): nodes that run"
        )
        run.expect(r"\[n-1\] restarting process(.*\n)+tick\r?\n")
        assert alive(run.pids()[1])
        run.process.send_signal(signal.SIGINT)
        assert run.finish() == 0
    assert "Traceback" not in run.text


def test_a_relay_that_dies_at_once_is_given_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosz.launch.run.output._MIN_LIFE", 1000.0)
    with launch(tmp_path, shell("n", "exec sleep 600", output="screen")) as run:
        pid = run.pid("n-1")
        os.kill(_relay_below(os.getpid()), signal.SIGKILL)
        run.err.wait_for("has died (-9): nodes started from now on have no output")
        assert alive(pid)
        assert run.stop() == 0


def _relay_below(pid: int) -> int:
    """Return the relay that a process has started."""
    for entry in Path(f"/proc/{pid}/task").iterdir():
        children: list[str] = []
        with suppress(OSError):  # the thread ended meanwhile
            children = (entry / "children").read_text().split()
        for child in children:
            with suppress(OSError):  # it ended meanwhile
                if b"relay.py" in Path(f"/proc/{child}/cmdline").read_bytes():
                    return int(child)
    raise AssertionError(f"{pid} has no relay")


def _age(pid: int) -> float:
    """Return the age of a process in seconds."""
    return time.time() - Path(f"/proc/{pid}").stat().st_ctime


def test_nodes_run_on_when_the_screen_is_closed(tmp_path: Path) -> None:
    count = tmp_path / "count"
    script = f"while :; do echo tick; echo >> {count}; done"
    with launch_process(tmp_path, shell("n", script, output="screen"), terminal=True) as run:
        run.expect("\ntick\r\n")
        os.close(run._reading)
        run._reading = os.open(os.devnull, os.O_RDONLY)
        eventually(count.exists, "count")
        before = count.stat().st_size
        eventually(lambda: count.stat().st_size > before + 20000, "ticks")
        run.process.send_signal(signal.SIGTERM)
        assert run.process.wait(60) == 0


def test_many_nodes_and_few_descriptors(tmp_path: Path) -> None:
    """The relay has more descriptors than the launch."""
    nodes = [shell(f"n{i}", f"echo up{i}; exec sleep 600", output="screen") for i in range(40)]
    limit = ("sh", "-c", 'ulimit -S -n 64; exec "$@"', "sh")
    with launch_process(tmp_path, *nodes, prefix=limit, separate=True) as run:
        for i in range(40):
            run.expect(rf"\bup{i}\n")
    assert (tmp_path / "err").read_text() == ""


def test_no_descriptors_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A node that cannot be started for this reason is named, and the others run on."""

    def refuse(*_: object) -> None:
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(RelayedOutput, "screen", refuse)
    nodes = shell("n", "exit 0", output="screen"), shell("m", "exec sleep 600")
    with launch(tmp_path, *nodes) as run:
        run.err.wait_for("cannot write the output of 'n-1' to the screen: Too many open files")
        assert alive(run.pid("m-2"))
        assert run.stop() == 1


STALLING = shell("n", "while :; do echo ticking along; done", output="screen")


@pytest.mark.parametrize("terminal", [False, True])
def test_a_blocked_screen_does_not_block_a_launch(tmp_path: Path, *, terminal: bool) -> None:
    """Nodes restart and end also while a pager or a lost connection blocks the screen."""
    count = tmp_path / "count"
    loud = f"echo >> {count}; seq 100; exit 3"
    nodes = STALLING, shell("m", loud, output="screen", respawn=True)
    with launch_process(tmp_path, *nodes, terminal=terminal) as run:
        run.expect(r"m-2\]: started with pid")
        run.expect("ticking")
        eventually(count.exists, "first start")
        before = count.stat().st_size
        eventually(lambda: count.stat().st_size > before + 3, "starts anew")
        (log,) = (tmp_path / "log/latest").glob("roslaunch-*.log")
        run.process.send_signal(signal.SIGINT)
        assert run.process.wait(TIMEOUT) == 0
    said = log.read_text()
    assert said.endswith("[INFO] done\n")
    pids = [int(pid) for pid in re.findall(r"started with pid \[(\d+)\]", said)]
    assert not any(map(alive, pids))
