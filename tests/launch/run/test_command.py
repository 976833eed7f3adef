"""The commands that run nodes."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from rosz.environment import Environment
from rosz.errors import ExecutableNotFound, PackageNotFound
from rosz.launch.plan.model import NodePlan
from rosz.launch.run import Workplace, run_command
from rosz.packages import PackageIndex

from .in_thread import HERE, shell

SCRIPT = (sys.executable, "-P", "-m", "rosz.script")


@pytest.fixture
def workplace(tmp_path: Path) -> Workplace:
    package = tmp_path / "ws/src/demo"
    (package / "scripts").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>demo</name></package>")
    for name, text, mode in (
        ("talker.py", "print()", 0o755),
        ("listener", "#!/usr/bin/env python2.7\n", 0o755),
        ("tool", "#!/bin/sh\n", 0o755),
        ("plain", "#!/bin/sh\n", 0o644),
    ):
        file = package / "scripts" / name
        file.write_text(text)
        file.chmod(mode)
    roots = (tmp_path / "ws/src",)
    environment = Environment(home=tmp_path / "home", package_roots=roots)
    environ = {"PATH": "/bin", "ROS_NAMESPACE": "/outer", "KEPT": "yes"}
    return Workplace(PackageIndex(roots), environment, environ, "/work")


def node(type_name: str, **settings: Any) -> NodePlan:
    defaults: dict[str, Any] = {"package": "demo", "namespace": "/", "name": "n", "place": HERE}
    return NodePlan(type=type_name, **{**defaults, **settings})


def test_arguments_are_in_roslaunch_order(workplace: Workplace, tmp_path: Path) -> None:
    plan = node("tool", args=("a", "b c"), remaps=(("x", "/y"), ("u", "v")))
    command = workplace.command(plan, log_file=Path("/log/n-1.log"), tag="t:1")
    program = str(tmp_path / "ws/src/demo/scripts/tool")
    words = ("a", "b c", "x:=/y", "u:=v", "__name:=n", "__log:=/log/n-1.log")
    assert command.argv == (program, *words)
    assert command.shown == command.argv
    assert not command.python


@pytest.mark.parametrize("name", ["talker.py", "listener"])
def test_scripts_run_with_the_interpreter_of_rosz(workplace: Workplace, name: str) -> None:
    command = workplace.command(node(name), log_file=None, tag="t:1")
    program = workplace.find("demo", name)
    assert command.argv == (*SCRIPT, program, "__name:=n")
    assert command.shown == (program, "__name:=n")
    assert command.python


def test_a_prefix_comes_first(workplace: Workplace) -> None:
    plan = node("talker.py", launch_prefix=("nice", "-n", "5"), output="screen")
    command = workplace.command(plan, log_file=None, tag="t:1")
    assert command.argv[:3] == ("nice", "-n", "5")
    assert command.argv[3:7] == SCRIPT
    assert command.direct


@pytest.mark.parametrize("python", ["python", "python3", "/usr/bin/python3.11"])
def test_a_prefix_that_is_python_is_the_interpreter(workplace: Workplace, python: str) -> None:
    plan = node("talker.py", launch_prefix=(python, "-m", "pdb"))
    command = workplace.command(plan, log_file=None, tag="t:1")
    program = workplace.find("demo", "talker.py")
    assert command.argv == (sys.executable, "-m", "pdb", "-m", "rosz.script", program, "__name:=n")


def test_variables(workplace: Workplace, tmp_path: Path) -> None:
    script = workplace.command(node("talker.py"), log_file=None, tag="t:1").environ
    assert script == {
        "PATH": "/bin",
        "KEPT": "yes",
        "ROSZ_PACKAGE_PATH": str(tmp_path / "ws/src"),
        "ROSZ_LAUNCH": "t:1",
    }
    program = workplace.command(node("tool"), log_file=None, tag="t:1").environ
    assert {**program, **script} == {**program, "PATH": "/bin"}
    assert program.keys() - script.keys() == {"PYTHONPATH", "ROSZ_PYTHON"}
    assert program["PATH"].endswith("/cli/bin:/bin")
    plan = node("tool", namespace="/a/b", env=(("X", "1"), ("X", "2"), ("KEPT", "no")))
    inner = workplace.command(plan, log_file=None, tag="t:2").environ
    assert inner["ROS_NAMESPACE"] == "/a/b"
    assert (inner["X"], inner["KEPT"]) == ("2", "no")


@pytest.mark.parametrize(
    ("cwd", "expected"),
    [("", "home"), ("ROS_HOME", "home"), ("ros_home", "home"), ("node", "ws/src/demo/scripts")],
)
def test_folder_of_a_node(workplace: Workplace, tmp_path: Path, cwd: str, expected: str) -> None:
    command = workplace.command(node("tool", cwd=cwd), log_file=None, tag="t:1")
    assert command.cwd == str(tmp_path / expected)


@pytest.mark.parametrize(("cwd", "expected"), [("ROS_HOME", "/work"), ("sub", "/work/sub")])
def test_folder_of_an_executable(workplace: Workplace, cwd: str, expected: str) -> None:
    command = workplace.command(shell("s", "exit 0", cwd=cwd), log_file=Path("/l"), tag="t:1")
    assert command.cwd == expected
    assert command.argv == ("sh", "-c", "exit 0")


def test_errors_suggest_similar_names(workplace: Workplace) -> None:
    with pytest.raises(ExecutableNotFound, match=r"no executable 'talkr\.py'.*'talker\.py'\?"):
        workplace.command(node("talkr.py"), log_file=None, tag="t")
    with pytest.raises(ExecutableNotFound, match=r"is not executable; run: chmod \+x /.*/plain"):
        workplace.command(node("plain"), log_file=None, tag="t")
    with pytest.raises(PackageNotFound, match=r"'demoo' not found .* did you mean 'demo'\?"):
        workplace.command(node("tool", package="demoo"), log_file=None, tag="t")


def test_run_takes_a_path_within_the_package(workplace: Workplace) -> None:
    command = run_command(workplace, "demo", "scripts/tool", ["-h", "a:=b"], prefix="nice -n '1'")
    assert command.argv == ("nice", "-n", "1", workplace.find("demo", "tool"), "-h", "a:=b")
    assert command.environ["ROS_NAMESPACE"] == "/outer"
    with pytest.raises(ExecutableNotFound, match=r"has no file '/.*/demo/tool'"):
        run_command(workplace, "demo", "./tool", [])
    with pytest.raises(ExecutableNotFound, match=r"scripts/plain' is not executable; run: chmod"):
        run_command(workplace, "demo", "scripts/plain", [])
