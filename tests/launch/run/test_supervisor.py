"""Processes start, end and restart, as in roslaunch."""

from __future__ import annotations

import os
import re
import signal
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest
from network import eventually

from rosz.errors import LaunchError, UsageError
from rosz.launch.plan.model import Condition, MachinePlan, NodePlan, Plan, Wait
from rosz.launch.run import Timeouts

from .in_thread import HERE, MemoryNetwork, alive, launch, program, shell

STUBBORN = (
    sys.executable,
    "-S",
    "-c",
    "import signal, sys, time\n"
    "for s in (signal.SIGINT, signal.SIGTERM): signal.signal(s, signal.SIG_IGN)\n"
    "open(sys.argv[1], 'w').close()\n"
    "time.sleep(600)\n",
)


def test_a_clean_end_is_reported_and_ends_the_launch(tmp_path: Path) -> None:
    with launch(tmp_path, shell("good", "exit 0", namespace="/a")) as run:
        assert run.join() == 0
    out = run.out.getvalue()
    logs = tmp_path / "log" / run.runner.run_id / "a-good-1*.log"
    assert f"[a/good-1] process has finished cleanly\nlog file: {logs}\n" in out
    assert "all processes on machine have died, rosz launch will exit\n" in out
    assert out.endswith(
        "shutting down processing monitor...\n... shutting down processing monitor complete\ndone\n"
    )
    assert run.err.getvalue() == ""


def test_a_death_is_reported_with_pid_code_and_command(tmp_path: Path) -> None:
    with launch(tmp_path, shell("bad", "echo last words >&2; exit 3")) as run:
        assert run.join() == 0
    err = run.err.getvalue()
    pid = run.pid("bad-1")
    assert (
        f"[bad-1] process has died [pid {pid}, exit code 3, cmd sh -c echo last words >&2; exit 3]."
        in err
    )
    assert re.search(r"DIED\n \* /bad \[bad-1\] ended with exit code 3 after \d+\.\d s\n", err)
    assert err.endswith(" s\n     last words\n")


def test_a_signal_is_a_negative_exit_code(tmp_path: Path) -> None:
    with launch(tmp_path, shell("shot", "kill -SEGV $$")) as run:
        assert run.join() == 0
    assert "exit code -11, cmd sh" in run.err.getvalue()
    assert "/shot [shot-1] was ended by SIGSEGV after" in run.err.getvalue()


def test_processes_are_numbered_in_order(tmp_path: Path) -> None:
    with launch(tmp_path, shell("a", "exit 0"), shell("b", "exit 0", namespace="/x/y")) as run:
        run.join()
    assert [run.pid("a-1") > 0, run.pid("x/y/b-2") > 0] == [True, True]


def test_required_ends_the_launch(tmp_path: Path) -> None:
    nodes = [shell("other", "exec sleep 600"), shell("vital", "exit 4", required=True)]
    with launch(tmp_path, *nodes) as run:
        assert run.join() == 1
    rule = "=" * 80
    err = run.err.getvalue()
    assert f"{rule}REQUIRED process [vital-2] has died!\nprocess has died [pid " in err
    assert f"vital-2*.log\nInitiating shutdown!\n{rule}\n" in err
    assert "[other-1] killing on exit\n" in run.out.getvalue()
    assert not alive(run.pid("other-1"))


def test_a_clean_end_of_a_required_node_is_not_a_failure(tmp_path: Path) -> None:
    with launch(tmp_path, shell("vital", "exit 0", required=True)) as run:
        assert run.join() == 0
    assert "process has finished cleanly\n" in run.err.getvalue()


def test_force_required_and_respawn_exclude_each_other(tmp_path: Path) -> None:
    with (
        pytest.raises(UsageError, match=r"test\.launch:3:5: node '/r' has respawn"),
        launch(tmp_path, shell("r", "exit 0", respawn=True), required=True),
    ):
        pass


def test_respawn_starts_again_until_stopped(tmp_path: Path) -> None:
    count = tmp_path / "count"
    script = f"echo >> {count}; test $(wc -l < {count}) = 3 && exec sleep 600; exit 1"
    with launch(tmp_path, shell("phoenix", script, respawn=True)) as run:
        run.pid("phoenix-1", 3)
        assert run.stop() == 0
    assert run.out.getvalue().count("[phoenix-1] restarting process\n") >= 2
    assert run.err.getvalue().count("[phoenix-1] process has died") >= 2
    assert "restarted 2 times" in run.err.getvalue()


def test_respawn_waits_its_delay(tmp_path: Path) -> None:
    beat = tmp_path / "beats"
    node = shell("p", f"date +%s.%N >> {beat}; exit 0", respawn=True, respawn_delay=0.5)
    with launch(tmp_path, node) as run:
        run.pid("p-1", 3)
        run.stop()
    times = [float(line) for line in beat.read_text().split()]
    assert all(later - earlier >= 0.5 for earlier, later in pairwise(times))


def test_respawn_max_gives_up(tmp_path: Path) -> None:
    with launch(tmp_path, shell("p", "exit 1", respawn=True, respawn_max=2)) as run:
        assert run.join() == 0
    assert run.out.getvalue().count("process[p-1]: started") == 3


def test_all_nodes_are_ended_at_once_in_reverse_order(tmp_path: Path) -> None:
    with launch(tmp_path, *(shell(f"n{i}", "exec sleep 600") for i in range(5))) as run:
        pids = [run.pid(f"n{i}-{i + 1}") for i in range(5)]
        assert run.stop() == 0
    said = [line for line in run.out.getvalue().splitlines() if line.endswith("killing on exit")]
    assert said == [f"[n{i}-{i + 1}] killing on exit" for i in reversed(range(5))]
    assert not any(map(alive, pids))
    assert "DIED" not in run.err.getvalue()


def test_sigint_then_sigterm_then_sigkill(tmp_path: Path) -> None:
    ready = tmp_path / "ready"
    node = program("mule", *STUBBORN, str(ready))
    with launch(tmp_path, node, timeouts=Timeouts(0.2, 0.1)) as run:
        pid = run.pid("mule-1")
        eventually(ready.exists, "handlers")
        assert run.stop() == 0
    assert not alive(pid)
    err = run.err.getvalue()
    assert "[mule-1] escalating to SIGTERM\n[mule-1] escalating to SIGKILL\n" in err
    assert "/mule [mule-1] did not end when asked to, and was killed after" in err


def test_sigint_is_enough_for_python(tmp_path: Path) -> None:
    ready = tmp_path / "ready"
    script = (
        "import sys, time\n"
        "try:\n open(sys.argv[1], 'w').close()\n while True: time.sleep(0.01)\n"
        "except KeyboardInterrupt: open(sys.argv[1], 'w').write('bye')\n"
    )
    with launch(tmp_path, program("p", sys.executable, "-S", "-c", script, str(ready))) as run:
        run.pid("p-1")
        eventually(ready.exists, "start")
        run.stop()
    assert ready.read_text() == "bye"
    assert "escalating" not in run.err.getvalue()


def test_grandchildren_end_with_their_node(tmp_path: Path) -> None:
    noted = tmp_path / "pids"
    script = (
        f"sleep 600 & echo $! > {noted}.new; setsid sleep 601 & "
        f"until pgrep -s $! sleep >> {noted}.new; do :; done; mv {noted}.new {noted}; wait"
    )
    with launch(tmp_path, shell("parent", script), timeouts=Timeouts(0.5, 0.3)) as run:
        run.pid("parent-1")
        eventually(noted.exists, "grandchildren")
        pids = [int(word) for word in noted.read_text().split()]
        assert len(pids) == 2
        assert all(map(alive, pids))
        run.stop()
    assert not any(map(alive, pids))


@pytest.mark.parametrize("start", ["", "setsid "], ids=["in its group", "in a session of its own"])
def test_descendants_of_a_dead_node_are_ended(tmp_path: Path, start: str) -> None:
    noted = tmp_path / "pid"
    inner = f"echo $$ > {noted}.new; mv {noted}.new {noted}; exec sleep 600"
    script = f"{start}sh -c '{inner}' & until test -e {noted}; do :; done; exit 1"
    with launch(tmp_path, shell("parent", script), shell("other", "exec sleep 600")) as run:
        run.err.wait_for("[parent-1] process has died")
        pid = int(noted.read_text())
        eventually(lambda: not alive(pid), "end of the grandchild")
        assert alive(run.pid("other-2"))


def test_a_node_that_cannot_start_does_not_stop_the_others(tmp_path: Path) -> None:
    with launch(tmp_path, program("ghost", "/no/such/program"), shell("b", "exit 0")) as run:
        assert run.join() == 1
    err = run.err.getvalue()
    assert "ERROR: cannot launch node of type [/ghost]: unable to launch [ghost-1]: No such" in err
    assert "process[b-2]: started" in run.out.getvalue()
    assert "/ghost [ghost-1] could not be started" in err


def test_a_required_node_that_cannot_start_ends_the_launch(tmp_path: Path) -> None:
    nodes = [shell("b", "exec sleep 600"), program("ghost", "/no/such", required=True)]
    with launch(tmp_path, *nodes) as run:
        assert run.join() == 1
    assert "REQUIRED process [ghost-2] cannot be started" in run.err.getvalue()
    assert not alive(run.pid("b-1"))


def test_a_program_without_a_first_line_is_explained(tmp_path: Path) -> None:
    script = tmp_path / "script"
    script.write_text("echo hello\n")
    script.chmod(0o755)
    with launch(tmp_path, program("s", str(script))) as run:
        assert run.join() == 1
    assert "first line must name its interpreter, such as '#!/bin/sh'" in run.err.getvalue()


def test_a_bad_launch_prefix_is_explained(tmp_path: Path) -> None:
    with launch(tmp_path, shell("s", "exit 0", launch_prefix=("nicee", "-n", "5"))) as run:
        assert run.join() == 1
    assert "is 'nicee' of its launch-prefix installed?" in run.err.getvalue()


def test_wait_for_delays_a_node(tmp_path: Path) -> None:
    wait = Wait((Condition("topic", "/scan"), Condition("param", "/go")), 30.0, HERE)
    network = MemoryNetwork()
    nodes = [shell("late", "exit 0", wait_for=(wait,)), shell("early", "exit 0")]
    with launch(tmp_path, *nodes, network=network) as run:
        run.out.wait_for("[late-1] waiting for topic /scan or param /go (at most 30 s)\n")
        run.out.wait_for("[early-2] process has finished cleanly")
        assert "process[late-1]" not in run.out.getvalue()
        network.true.add("param /go")
        assert run.join() == 0
    assert "process[late-1]: started" in run.out.getvalue()


def test_wait_for_gives_up(tmp_path: Path) -> None:
    wait = Wait((Condition("service", "/plan"),), 0.1, HERE)
    with launch(tmp_path, shell("late", "exit 0", wait_for=(wait,))) as run:
        assert run.join() == 1
    assert "test.launch:3:5: no service /plan within 0.1 s" in run.err.getvalue()


def test_a_waiting_node_does_not_delay_the_end(tmp_path: Path) -> None:
    wait = Wait((Condition("service", "/plan"),), 600.0, HERE)
    with launch(tmp_path, shell("late", "exit 0", wait_for=(wait,))) as run:
        run.out.wait_for("waiting for service /plan")
        assert run.stop() == 0


def test_spawn_delay(tmp_path: Path) -> None:
    stamp = f"date +%s.%N > {tmp_path}"
    nodes = [shell("a", f"{stamp}/a", spawn_delay=0.4), shell("b", f"{stamp}/b")]
    began = time.time()
    with launch(tmp_path, *nodes) as run:
        assert run.join() == 0
    assert float((tmp_path / "a").read_text()) - began >= 0.4
    text = run.out.getvalue()
    assert text.index("process[b-2]: started") < text.index("process[a-1]: started")


def test_restart_and_stop_one(tmp_path: Path) -> None:
    from rosz.launch.run.supervisor import Supervisor

    done: list[str] = []
    with launch(
        tmp_path, shell("a", "exec sleep 600"), shell("b", "exec sleep 600", respawn=True)
    ) as run:
        first, second = run.pid("a-1"), run.pid("b-2")
        runner = run.runner
        supervisor = runner._stop.__self__  # type: ignore[attr-defined]
        assert isinstance(supervisor, Supervisor)
        runner._loop.post(
            lambda: supervisor.restart(supervisor.find("/a"), lambda: done.append("a"))
        )
        assert run.pid("a-1", 2) != first
        runner._loop.post(lambda: supervisor.stop(supervisor.find("b"), lambda: done.append("b")))
        eventually(lambda: done == ["a", "b"], "end of both orders")
        assert not alive(first)
        assert not alive(second)
        assert alive(run.pid("a-1", 2))
    assert "[b-2] kill requested\n" in run.out.getvalue()
    assert run.out.getvalue().count("process[b-2]: started") == 1


def test_a_remote_machine_is_refused_before_anything_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = MachinePlan("base", "robot1", "", 22, "", "", 10.0, True, HERE)
    node = NodePlan(package="p", type="t", name="n", namespace="/", place=HERE, machine="base")
    started = tmp_path / "started"
    monkeypatch.setenv("PATH", "/nowhere")
    with (
        pytest.raises(LaunchError, match=r"test\.launch:3:5: machine 'base' needs ssh"),
        launch(tmp_path, shell("a", f"touch {started}"), node, plan=Plan(machines=(machine,))) as r,
    ):
        r.join()
    assert not started.exists()


def test_local_leaves_remote_nodes_out(tmp_path: Path) -> None:
    machine = MachinePlan("base", "robot1", "", 22, "", "", 10.0, True, HERE)
    node = NodePlan(package="p", type="t", name="n", namespace="/", place=HERE, machine="base")
    plan = Plan(machines=(machine,))
    with launch(tmp_path, shell("a", "exit 0"), node, plan=plan, local=True) as run:
        assert run.join() == 0


def test_children_are_watched_without_pidfd(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "pidfd_open")
    with launch(tmp_path, shell("a", "exit 7"), shell("b", "exec sleep 600")) as run:
        run.err.wait_for("exit code 7")
        run.stop()
    assert not alive(run.pid("b-2"))


def test_a_process_killed_from_outside_is_reported(tmp_path: Path) -> None:
    with launch(tmp_path, shell("a", "exec sleep 600")) as run:
        os.kill(run.pid("a-1"), signal.SIGKILL)
        run.join()
    assert "/a [a-1] was ended by SIGKILL" in run.err.getvalue()
