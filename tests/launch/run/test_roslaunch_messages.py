"""The messages of a launch equal those of real roslaunch on the same file."""

from __future__ import annotations

import os
import re
import shutil
import signal
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from network import Program, free_port

from rosz.launch.plan import SystemContext, plan
from rosz.packages import PackageIndex

from .in_process import PROGRAM, ROOT
from .in_thread import TIMEOUT

pytestmark = pytest.mark.skipif(
    shutil.which("roslaunch") is None, reason="roslaunch is not installed (python3-roslaunch)"
)

# roslaunch prints a message and its line end apart: what a node says begins and ends a line.
SCRIPTS = {
    "quick": "#!/bin/sh\nprintf '\\nquick %s\\n' \"$*\"\n",
    "broken": "#!/bin/sh\nsleep 0.3\nexit 3\n",
    "crashing": "#!/bin/sh\nsleep 0.3\nkill -SEGV $$\n",
    "lasting": "#!/bin/sh\nprintf '\\nlasting\\n'\nexec sleep 600\n",
    "stubborn": "#!/usr/bin/python3 -S\n"
    "import signal, time\n"
    "for s in (signal.SIGINT, signal.SIGTERM): signal.signal(s, signal.SIG_IGN)\n"
    "print('\\nstubborn', flush=True)\n"
    "time.sleep(600)\n",
}

ALL_FATES = """
<launch>
  <param name="text" value="a text of more than twenty characters"/>
  <param name="short" value="x "/>
  <rosparam>{list: [1, 2.5, true], nested: {odd: "a\\tb", one: 1}}</rosparam>
  <group ns="space">
    <node pkg="fates" type="quick" name="quick" output="screen" args="a 'b c'">
      <remap from="x" to="/y"/>
    </node>
  </group>
  <node pkg="fates" type="broken" name="broken"/>
  <node pkg="fates" type="crashing" name="crashing" output="screen"/>
  <node pkg="fates" type="absent" name="absent"/>
  <node pkg="fates" type="lasting" name="lasting" output="screen"/>
  <node pkg="fates" type="stubborn" name="stubborn" output="screen"/>
</launch>
"""
SEEN = (
    r"\[broken-\d\] process has died",
    "quick a b c",
    r"\[crashing-\d\] process has died",
    r"(?:^|\x1b\[0m)lasting$",  # roslaunch ends some of its lines late
    r"(?:^|\x1b\[0m)stubborn$",
)

REQUIRED = """
<launch>
  <param name="text" value="any"/>
  <node pkg="fates" type="lasting" name="lasting"/>
  <node pkg="fates" type="broken" name="vital" required="true"
        launch-prefix="sh -c 'sleep 0.5; exit 4'"/>
</launch>
"""

# What only roslaunch says, about its master and its logs.
THEIRS = re.compile(
    r"\.\.\. logging to |Checking log |Press Ctrl-C|Done checking log|started roslaunch server"
    r"|auto-starting new master|.*\bmaster\b|ROS_MASTER_URI|.*\brosout-|started core service"
    r"|setting /run_id| \* /rosdistro| \* /rosversion|WARNING: Package name"
)


@pytest.fixture
def packages(tmp_path: Path) -> Path:
    package = tmp_path / "packages/fates"
    package.mkdir(parents=True)
    (package / "package.xml").write_text(
        "<package format='2'><name>fates</name><version>0.0.1</version><description>d</description>"
        "<maintainer email='a@b.c'>a</maintainer><license>MIT</license></package>"
    )
    for name, text in SCRIPTS.items():
        (package / name).write_text(text)
        (package / name).chmod(0o755)
    return tmp_path / "packages"


@contextmanager
def started(command: list[str], folder: Path, packages: Path) -> Iterator[Program]:
    environ = {
        **os.environ,
        "HOME": str(folder),
        "ROS_HOME": str(folder / "home"),
        "ROS_LOG_DIR": str(folder / "log"),
        "ROS_PACKAGE_PATH": str(packages),
        "ROS_IP": "127.0.0.1",
        "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}",
        "PYTHONPATH": str(ROOT) if command[0] == sys.executable else "",
    }
    with closing(Program(command, environ, separate=True)) as program:
        try:
            yield program
        finally:
            if program.process.poll() is None:
                program.send(signal.SIGTERM)
                program.exit_code(TIMEOUT)


def ours(folder: Path, packages: Path, options: str) -> list[str]:
    index = PackageIndex([packages])
    context = SystemContext(index, {}, folder, lambda base: base)
    made = plan([folder / "test.launch"], {}, context)
    (folder / "plan.json").write_bytes(made.to_json())
    words = [str(folder), str(folder / "plan.json"), options, str(packages)]
    return [sys.executable, str(PROGRAM), *words]


def theirs(folder: Path, *options: str) -> list[str]:
    return ["roslaunch", *options, str(folder / "test.launch")]


def plain(output: list[str], folder: Path) -> list[str]:
    """Return the sorted messages without the parts that differ from run to run."""
    text = "\n".join([*output, ""]).partition("\nDIED\n")[0]
    text = re.sub(r"\x1b\[\d*m|\x1b\]2;.*?\x07", "", text)
    # roslaunch's threads and its nodes print into each other's lines.
    text = re.sub(r"(?=\[[\w/]+-\d+\] (?:killing|escalating|process has)|ERROR: )", "\n", text)
    text = re.sub(r"(process\[.*?\]: started with pid \[\d+\])", r"\n\1\n", text)
    text = re.sub(rf"{folder}/log/[0-9a-f-]+", "LOGS", text)
    text = re.sub(r"pid \[?\d+\]?", "pid PID", text)
    text = re.sub(r"(\w)-\d+(?=[\]*.])", r"\1-N", text)
    text = re.sub(r"(cannot launch node of type \[.*?\]): .*", r"\1", text)
    lines = [line.rstrip() for line in text.splitlines()]
    return sorted(line for line in lines if line and not THEIRS.match(line))


def test_all_ends_of_a_node(tmp_path: Path, packages: Path) -> None:
    (tmp_path / "test.launch").write_text(ALL_FATES)
    # Time enough for those that a signal ends.
    timeouts = ("--sigint-timeout=2", "--sigterm-timeout=0.2")
    options = '{"timeouts": {"sigint": 2, "sigterm": 0.2}}'
    said = []
    for command in (theirs(tmp_path, *timeouts), ours(tmp_path, packages, options)):
        with started(command, tmp_path, packages) as run:
            for pattern in SEEN:
                run.wait_for(re.compile(pattern), TIMEOUT)
            run.send(signal.SIGINT)
            run.exit_code(TIMEOUT)
        said.append([plain(lines, tmp_path) for lines in (run.lines, run.errors)])
    real, rosz = said
    assert rosz[0] == real[0]
    # The summary at the end says in other words what is left of the shutdown's errors.
    ending = ("Shutdown errors:", " * process[")
    assert rosz[1] == [line for line in real[1] if not line.startswith(ending)]


def test_required(tmp_path: Path, packages: Path) -> None:
    (tmp_path / "test.launch").write_text(REQUIRED)
    said = []
    for command in (theirs(tmp_path), ours(tmp_path, packages, "{}")):
        with started(command, tmp_path, packages) as run:
            run.exit_code(TIMEOUT)
        said.append([plain(lines, tmp_path) for lines in (run.lines, run.errors)])
    real, rosz = said
    # roslaunch says that it kills the process that has just died, too.
    assert rosz[0] == [line for line in real[0] if line != "[vital-N] killing on exit"]
    assert rosz[1] == real[1]
