"""``rosz pkg check``, and the lines of course documents around ``catkin_make``."""

from __future__ import annotations

import json
import os
import pty
import subprocess
from pathlib import Path

import pytest
from network import Network

from .command import ROSZ, environ, read_all, rosz
from .test_env import evaluate


def test_a_sound_workspace(tmp_path: Path) -> None:
    (tmp_path / "src").mkdir()
    rosz(tmp_path / "src", "pkg", "create", "demo")
    done = rosz(tmp_path, "pkg", "check")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "checked 1 package: 0 errors, 0 warnings; nothing needs building\n"


def test_problems_are_reported_with_their_place(tmp_path: Path) -> None:
    (tmp_path / "src").mkdir()
    rosz(tmp_path / "src", "pkg", "create", "demo")
    (tmp_path / "src/demo/msg/Odd.msg").write_text("int3 x\n")
    done = rosz(tmp_path, "pkg", "check", "demo", variables={"ROSZ_PACKAGE_PATH": "src"})
    assert (done.returncode, done.stderr) == (1, "")
    line, summary = done.stdout.splitlines()
    assert line.startswith("src/demo/msg/Odd.msg:1:1: error: type 'int3' of field 'x'")
    assert summary == "checked 1 package: 1 error, 0 warnings"
    as_json = rosz(tmp_path, "pkg", "check", "--json")
    assert as_json.returncode == 1
    (package,) = json.loads(as_json.stdout)
    assert package["problems"][0]["line"] == 1


def test_no_workspace(tmp_path: Path) -> None:
    done = rosz(tmp_path, "pkg", "check")
    assert done.returncode == 1
    assert "no package in the workspace around" in done.stderr


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_steps_of_a_course(network: Network, shell: str) -> None:
    done = evaluate(
        network,
        shell,
        "mkdir -p catkin_ws/src",
        "cd catkin_ws/src",
        '"$ROSZ_PYTHON" -P -m rosz pkg create beginner_tutorials std_msgs rospy roscpp',
        "cd ..",
        "catkin_make -j4 -DCMAKE_BUILD_TYPE=Release",
        f"source devel/setup.{shell}",
        "cd /",
        "roscd beginner_tutorials/scripts && pwd",
        "rosls beginner_tutorials",
        "rosmsg show beginner_tutorials/Number",
        "timeout 300 rosrun beginner_tutorials talker.py _rate:=100 &",
        "timeout 200 sh -c 'until rostopic list 2>/dev/null | grep -q /numbers; do :; done'",
        "rostopic echo -n 1 /numbers",
        "rosnode kill /talker",
        timeout=300,
    )
    assert "WARNING: dependency" not in done.stderr
    out = done.stdout
    assert "checked 1 package: 0 errors, 0 warnings; nothing needs building\n" in out
    assert f"{network.folder}/catkin_ws/src/beginner_tutorials/scripts\n" in out
    assert "launch\nmsg\npackage.xml\nscripts\n" in out
    assert "int64 data\nstring name\n" in out
    assert 'name: "tick"\n---\n' in out
    assert "killed" in out


@pytest.mark.parametrize(("kind", "escapes"), [("xterm", True), ("dumb", False)])
def test_a_dumb_terminal_gets_no_escapes(tmp_path: Path, kind: str, *, escapes: bool) -> None:
    (tmp_path / "src").mkdir()
    rosz(tmp_path / "src", "pkg", "create", "demo")
    (tmp_path / "src/demo/msg/Odd.msg").write_text("int3 x\n")
    ours, theirs = pty.openpty()
    done = subprocess.run(
        [*ROSZ, "pkg", "check"],
        cwd=tmp_path,
        env=environ(tmp_path, TERM=kind),
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=theirs,
        check=False,
    )
    os.close(theirs)
    written = read_all(ours).decode()
    assert done.returncode == 1
    assert "Odd.msg:1:1: " in written
    assert ("\033[" in written) == escapes
