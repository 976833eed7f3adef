"""What the options of ``rosz launch`` do to a launch that runs."""

from __future__ import annotations

import json
import re
import signal
import time
from pathlib import Path

import pytest
from network import Network, eventually

from rosz.launch.run import Options, Timeouts

from .command import package
from .launching import Start, rosz, runs, started
from .shell import Shell

STUBBORN = "#!/bin/sh\ntrap '' INT TERM\necho up\nwhile :; do sleep 0.1; done\n"
TALKS = "#!/bin/sh\necho talking\nexec sleep 600\n"
ENDS = "#!/bin/sh\necho last words >&2\nexit 3\n"


@pytest.fixture
def demo(network: Network) -> Path:
    """A package with some programs in it."""
    return package(
        network.folder / "src",
        "demo",
        stubborn=STUBBORN,
        talks=TALKS,
        ends=ENDS,
        done="#!/bin/sh\n",
    )


def write(demo: Path, body: str, name: str = "x.launch") -> str:
    file = demo / name
    file.write_text(f"<launch>{body}</launch>")
    return str(file)


def test_screen_and_log_override_the_file(launch: Start, demo: Path) -> None:
    body = '<node pkg="demo" type="talks" name="a"/>'
    quiet = '<node pkg="demo" type="talks" name="b" output="screen"/>'
    assert launch("--screen", write(demo, body)).wait_for("talking")
    run = launch("--log", write(demo, quiet, "y.launch"))
    run.wait_for("process[b-1]: started")
    (log,) = eventually_files(run.output, "b-1-stdout.log")
    eventually(lambda: log.read_text() == "talking\n", "the line in the log")
    assert "talking" not in run.output


def eventually_files(output: str, name: str) -> list[Path]:
    """Return the files of a name in the folder that a launch logs to."""
    folder = Path(output.partition("... logging to ")[2].splitlines()[0]).parent
    eventually((folder / name).exists, name)
    return [folder / name]


def test_required_for_all(launch: Start, demo: Path) -> None:
    body = '<node pkg="demo" type="talks" name="stays"/><node pkg="demo" type="ends" name="goes"/>'
    run = launch("--required", write(demo, body))
    assert run.exit_code() == 1
    assert "REQUIRED process [goes-2] has died!" in run.output
    assert "[stays-1] killing on exit" in run.output
    died = run.output.partition("\nDIED\n")[2]
    assert died.startswith(" * /goes [goes-2] ended with exit code 3 after ")
    assert "\n     last words\n" in died


def test_timeouts_reach_the_runner(
    shell: Shell, demo: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[Timeouts] = []

    def run(_: object, options: Options, *, wait: bool) -> int:
        assert not wait
        given.append(options.timeouts)
        return 0

    monkeypatch.setattr("rosz.cli.launch._Launch.run", run)
    file = str(write(demo, '<node pkg="demo" type="talks" name="talks"/>'))
    assert shell("launch", "--sigint-timeout", "0.4", "--sigterm-timeout", "0.3", file).code == 0
    assert shell("launch", file).code == 0
    assert given == [Timeouts(0.4, 0.3), Timeouts(15, 2)]


def test_timeouts_of_the_command_line(launch: Start, demo: Path) -> None:
    body = '<node pkg="demo" type="stubborn" name="mule" output="screen"/>'
    run = launch("--sigint-timeout", "0.4", "--sigterm-timeout", "0.3", write(demo, body))
    run.wait_for("up")
    begin = time.monotonic()
    run.send(signal.SIGINT)
    assert run.exit_code() == 0
    assert time.monotonic() - begin >= 0.7
    escalations = re.findall(r"\[mule-1\] escalating to (SIG\w+)", run.output)
    assert escalations == ["SIGTERM", "SIGKILL"]
    assert "mule-1] did not end when asked to, and was killed" in run.output


def test_verbose_and_pid_file_and_no_summary(launch: Start, demo: Path) -> None:
    pid = demo / "pid"
    file = write(demo, '<node pkg="demo" type="talks" name="a" args="one two"/>')
    run = launch("-v", "--no-summary", "--pid", str(pid), file)
    run.wait_for(f"process[a-1]: {demo}/scripts/talks one two __name:=a __log:=")
    assert int(pid.read_text()) == run.pid
    assert "SUMMARY" not in run.output


def test_several_files_and_standard_input(launch: Start, demo: Path) -> None:
    first = write(demo, '<arg name="who"/><node pkg="demo" type="talks" name="$(arg who)"/>')
    run = launch(first, "-", "who:=first")
    assert run.process.stdin is not None
    run.process.stdin.write(
        '<launch><node pkg="demo" type="talks" name="second" output="screen"/></launch>'
    )
    run.process.stdin.close()
    run.wait_for("talking")
    run.wait_for("process[second-2]: started")
    assert list(started(run)) == ["first", "second"]


def test_several_files_share_nothing_but_the_plan(network: Network, demo: Path) -> None:
    first = write(demo, '<arg name="a" default="1"/><param name="p" value="$(arg a)"/>')
    second = write(demo, '<param name="q" value="$(arg a)"/>', "y.launch")
    done = rosz(network, "launch", "--dump-params", first, second)
    assert done.returncode == 1
    assert done.stderr == (
        f"ERROR: {second}:1:32: arg 'a' is not set;"
        " declare it before: <arg name='a' default='…'/>\n"
    )


def test_an_undeclared_arg_is_a_warning(network: Network, demo: Path) -> None:
    file = write(demo, '<arg name="rate" default="1"/><node pkg="demo" type="done" name="a"/>')
    done = rosz(network, "launch", file, "raet:=2")
    assert done.returncode == 0
    warning = "no file declares an arg 'raet', so 'raet:=…' does nothing; did you mean 'rate'?"
    assert warning in done.stderr


def test_a_deprecated_launch_says_so(network: Network, demo: Path) -> None:
    inner = demo / "old.launch"
    inner.write_text(
        '<launch deprecated="use new.launch"><node pkg="demo" type="done" name="a"/></launch>'
    )
    done = rosz(network, "launch", write(demo, f'<include file="{inner}"/>'))
    assert done.returncode == 0
    assert f"WARNING: {inner}:1:1: use new.launch" in done.stderr.replace("\n  ", " ")


def test_tests_are_left_to_their_runner(network: Network, demo: Path) -> None:
    body = '<test pkg="demo" type="ends" test-name="t"/><node pkg="demo" type="done" name="a"/>'
    done = rosz(network, "launch", write(demo, body))
    assert (done.returncode, done.stdout.count("started with pid")) == (0, 1)


def test_an_unknown_tag_is_a_warning(network: Network, demo: Path) -> None:
    body = '<nod pkg="demo" type="ends" name="a"/><node pkg="demo" type="done" name="b"/>'
    done = rosz(network, "launch", write(demo, body))
    assert done.returncode == 0
    assert "1:9: <nod> means nothing in <launch>; did you mean 'node'?" in done.stderr
    assert done.stdout.count("started with pid") == 1


def test_a_group_waits_until_its_timeout(launch: Start, demo: Path) -> None:
    body = (
        '<group wait_for="service /nobody" wait_timeout="0.3">'
        '<node pkg="demo" type="talks" name="late"/></group>'
    )
    run = launch(write(demo, body))
    assert run.exit_code() == 1
    assert "/nobody" in run.output
    assert not started(run)


def test_respawn_max_and_delay(launch: Start, demo: Path) -> None:
    body = (
        '<node pkg="demo" type="ends" name="a" respawn="true" respawn_delay="0.2" respawn_max="2"/>'
    )
    begin = time.monotonic()
    run = launch(write(demo, body))
    run.exit_code()
    assert time.monotonic() - begin >= 0.4
    assert run.output.count("process[a-1]: started") == 3
    assert "restarted 2 times" in run.output


def test_ros_2_spellings_run(launch: Start, demo: Path) -> None:
    show = demo / "scripts/show"
    show.write_text('#!/bin/sh\necho "$0 $ROS_NAMESPACE $COLOUR $1"\nexec sleep 600\n')
    show.chmod(0o755)
    body = (
        '<let name="word" value="hi"/><set_env name="COLOUR" value="red"/>'
        '<group><push_ros_namespace namespace="robot"/>'
        '<node pkg="demo" exec="show" name="a" namespace="arm" args="$(var word)"'
        ' output="screen"/></group>'
        '<executable cmd="ls $(find-pkg-share demo)" name="list" output="screen"/>'
    )
    run = launch(write(demo, body))
    assert run.wait_for("scripts/show") == f"{show} /robot/arm red hi"
    run.wait_for("package.xml")
    run.wait_for("process[list-2]: started")
    assert list(started(run)) == ["robot/arm/a", "list"]


def test_a_prefix_is_split_as_a_shell_does(launch: Start, demo: Path) -> None:
    body = (
        '<node pkg="demo" type="done" name="a" output="screen"'
        """ launch-prefix="sh -c 'echo prefixed $0; exec sleep 600'"/>"""
    )
    run = launch(write(demo, body))
    assert run.wait_for("prefixed") == f"prefixed {demo}/scripts/done"


def test_grandchildren_end_with_a_launch(launch: Start, demo: Path) -> None:
    family = demo / "scripts/family"
    family.write_text(
        "#!/bin/sh\nsetsid sh -c 'trap \"\" INT TERM HUP; echo I am $$; exec sleep 600' &\nwait\n"
    )
    family.chmod(0o755)
    file = write(demo, '<node pkg="demo" type="family" name="a" output="screen"/>')
    run = launch("--sigint-timeout", "0.3", "--sigterm-timeout", "0.3", file)
    pid = int(run.wait_for("I am ").split()[-1])
    assert runs(pid)
    run.send(signal.SIGHUP)
    assert run.exit_code() == 0
    eventually(lambda: not runs(pid), "end of the grandchild")


def test_status_as_json_and_a_stop(launch: Start, network: Network, demo: Path) -> None:
    run = launch(write(demo, '<node pkg="demo" type="talks" name="a" output="screen"/>'))
    run.wait_for("talking")
    eventually(lambda: started(run), "the launch's word of it")
    (status,) = json.loads(rosz(network, "launch", "--status", "--json").stdout)
    (node,) = status["nodes"]
    assert (node["name"], node["state"], node["restarts"]) == ("/a", "running", 0)
    assert node["pid"] == started(run)["a"]
    assert node["memory"] > 0
    assert rosz(network, "launch", "--stop", "/a").returncode == 0
    assert run.exit_code() == 0
    assert not runs(node["pid"])
