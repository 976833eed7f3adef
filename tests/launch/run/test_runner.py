"""The steps before the first process: parameters, the log folder, the summary."""

from __future__ import annotations

import os
import re
import socket
from pathlib import Path

import pytest

from rosz.errors import LaunchError, ParamError
from rosz.launch.plan.model import Notice, Plan

from .in_thread import HERE, MemoryNetwork, launch, param, setup, shell


def test_parameters_are_one_batch_before_any_node(tmp_path: Path) -> None:
    network = MemoryNetwork(run_id="5-f", old={"x": 1})
    plan = Plan(
        params=(param("/a", 1), param("~b", [1, 2]), param("/old/x", 2)), clear=("/old", "/gone")
    )
    with launch(tmp_path, shell("n", "exit 0"), plan=plan, network=network) as run:
        run.join()
    ((values, deleted),) = network.batches
    uri = values.popitem()
    assert deleted == ["/old", "/gone"]
    assert uri == ("/old/x", 2)
    assert values["/roslaunch/b"] == [1, 2]
    assert list(values)[1:] == ["/a", "/roslaunch/b"]


def test_a_bad_parameter_starts_nothing(tmp_path: Path) -> None:
    class Refusing(MemoryNetwork):
        def write(self, *_args: object) -> None:
            raise ParamError("'/' cannot be 1")

    started = tmp_path / "started"
    with (
        pytest.raises(ParamError),
        launch(tmp_path, shell("n", f"touch {started}"), network=Refusing()) as run,
    ):
        run.join()
    assert not started.exists()


def test_what_a_core_sets_is_set_once(tmp_path: Path) -> None:
    network = MemoryNetwork()
    with launch(tmp_path, shell("n", "exit 0"), network=network) as first:
        first.join()
    with launch(tmp_path, shell("n", "exit 0"), network=network) as second:
        second.join()
    assert network.values["/run_id"] == first.runner.run_id == second.runner.run_id
    assert re.fullmatch(r"[0-9a-f-]{36}", first.runner.run_id)
    assert network.values["/rosdistro"] == "noetic\n"
    assert network.values["/rosversion"] == "1.17.4\n"
    assert f"setting /run_id to {first.runner.run_id}\n" in first.out.getvalue()
    assert "setting /run_id" not in second.out.getvalue()
    host = re.sub(r"[^a-z0-9]", "_", socket.gethostname().lower())
    assert network.values[f"/roslaunch/uris/host_{host}__{os.getpid()}"].startswith("rosz://")


@pytest.mark.parametrize("run_id", [7, "../evil", ""])
def test_a_run_id_that_is_not_a_folder_name_is_replaced(tmp_path: Path, run_id: object) -> None:
    network = MemoryNetwork(run_id=run_id)
    with launch(tmp_path, shell("n", "exit 0"), network=network) as run:
        run.join()
    assert network.values["/run_id"] == run.runner.run_id != run_id


def test_the_folder_of_a_run(tmp_path: Path) -> None:
    with launch(tmp_path, shell("n", "exit 0")) as run:
        run.join()
    folder = tmp_path / "log" / run.runner.run_id
    assert (tmp_path / "log/latest").readlink() == Path(run.runner.run_id)
    assert sorted(file.name for file in folder.iterdir()) == [
        "n-1-stdout.log",
        f"roslaunch-{socket.gethostname()}-{os.getpid()}.log",
    ]
    log = next(folder.glob("roslaunch-*")).read_text()
    assert "[INFO] process[n-1]: sh -c exit 0\n" in log
    assert run.out.getvalue().startswith(f"... logging to {folder}/roslaunch-")


def test_a_launch_runs_without_logs(tmp_path: Path) -> None:
    (tmp_path / "log").write_text("in the way")
    with launch(tmp_path, shell("n", "exit 0")) as run:
        assert run.join() == 0
    assert re.match(
        r"WARNING: cannot keep logs in '/.*': Not a directory; set ROS_LOG_DIR to a folder that can"
        r" be written to; continuing without logs\n",
        run.err.getvalue(),
    )
    assert "[n-1] process has finished cleanly\n[" not in run.out.getvalue()


def test_setup_steps_come_first(tmp_path: Path) -> None:
    target = tmp_path / "dump.yaml"
    network = MemoryNetwork(a=1, b=2)
    steps = (
        setup("dump", "/a", str(target)),
        setup("delete", "/a"),
        setup("delete", "/a"),
        setup("dump", "/a", str(target)),
    )
    plan = Plan(setup=steps, params=(param("/a", 3),))
    with launch(tmp_path, shell("n", "exit 0"), plan=plan, network=network) as run:
        run.join()
    assert target.read_text() == "1\n"
    assert network.values["/a"] == 3
    assert network.batches[0] == ({}, ["/a"])
    assert run.err.getvalue() == (
        "test.launch:3:5: parameter '/a' is not set, so it is not deleted\n"
        "test.launch:3:5: parameter '/a' is not set, so it is not dumped\n"
    )


def test_a_dump_that_cannot_be_written_stops_the_launch(tmp_path: Path) -> None:
    plan = Plan(setup=(setup("dump", "/a", "/proc/nowhere/x"),))
    with (
        pytest.raises(LaunchError, match=r"test\.launch:3:5: cannot dump to '/proc/nowhere/x'"),
        launch(tmp_path, plan=plan, network=MemoryNetwork(a=1)) as run,
    ):
        run.join()


@pytest.mark.parametrize("kind", ["link", "pipe", "folder"])
def test_a_dump_needs_a_regular_file(tmp_path: Path, kind: str) -> None:
    target, precious = tmp_path / "dump.yaml", tmp_path / "precious"
    precious.write_text("mine\n")
    if kind == "link":
        target.symlink_to(precious)
    elif kind == "pipe":
        os.mkfifo(target)
    else:
        target.mkdir()
    reason = f"is a link to '{precious}'" if kind == "link" else "is not a regular file"
    plan = Plan(setup=(setup("dump", "/a", str(target)),))
    with (
        pytest.raises(LaunchError, match=rf"cannot dump to '{target}': it {reason}"),
        launch(tmp_path, plan=plan, network=MemoryNetwork(a=1)) as run,
    ):
        run.join()
    assert precious.read_text() == "mine\n"


@pytest.mark.parametrize("found", ["../../up", "", "a" * 70_000, "-", "a/b", 7, "ä"])
def test_a_run_id_of_another_type_is_replaced(tmp_path: Path, found: object) -> None:
    """Any process on the network may have set it."""
    network = MemoryNetwork(run_id=found)
    with launch(tmp_path, shell("n", "exit 0"), network=network) as run:
        assert run.join() == 0
    assert network.values["/run_id"] == run.runner.run_id != found
    assert (tmp_path / "log" / run.runner.run_id).is_dir()


def test_a_launch_without_nodes_holds_the_parameters_when_alone(tmp_path: Path) -> None:
    with launch(tmp_path, plan=Plan(params=(param("/a", 1),))) as run:
        run.out.wait_for("nobody else holds the parameters: staying until Ctrl-C\n")
        assert run.code is None
        assert run.stop() == 0
    assert "No processes to monitor\n" in run.out.getvalue()


def test_warnings_are_shown_with_their_place(tmp_path: Path) -> None:
    plan = Plan(
        warnings=(Notice("<nod> is no tag", HERE),), deprecations=(Notice("use other", HERE),)
    )
    with launch(tmp_path, shell("n", "exit 0"), plan=plan) as run:
        run.join()
    assert run.err.getvalue() == (
        "WARNING: test.launch:3:5: <nod> is no tag\nWARNING: test.launch:3:5: use other\n"
    )


def test_the_overview_can_be_left_out(tmp_path: Path) -> None:
    with launch(tmp_path, shell("n", "exit 0"), overview=False) as run:
        run.join()
    assert "SUMMARY" not in run.out.getvalue()


def test_verbose_shows_command_lines(tmp_path: Path) -> None:
    with launch(tmp_path, shell("n", "exit 0"), verbose=True) as run:
        run.join()
    assert "process[n-1]: sh -c exit 0\n" in run.out.getvalue()
