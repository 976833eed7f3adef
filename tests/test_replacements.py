"""What commands, imports and launch files say of the names of ROS that rosz does not have."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from network import Network

import rosz.cli.env
from rosz.cli.commands import COMMANDS as OWN
from rosz.replacements import COMMANDS, instead_of
from rosz.web.window import WINDOWS

ABSENT = Path(rosz.cli.env.__file__).parent / "absent"


def evaluate(network: Network, line: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a line in a shell that has evaluated what ``rosz env`` prints."""
    return subprocess.run(
        ["bash", "-c", f'eval "$({sys.executable} -P -m rosz env bash)"\n{line}'],
        env=network.variables(PATH="/bin:/usr/sbin", **variables),
        cwd=network.folder,
        capture_output=True,
        text=True,
        timeout=40,
        check=False,
    )


def test_each_command_has_a_program() -> None:
    windows = set(WINDOWS) - {"rqt_gui"}
    assert {file.name for file in ABSENT.iterdir()} == windows | set(COMMANDS)
    for file in ABSENT.iterdir():
        package = "rqt_gui" if file.name == "rqt" else file.name
        words = f'run {package} {package} "$@"' if file.name in windows else file.name
        line = f'exec "${{ROSZ_PYTHON:-python3}}" -P -m rosz {words}'
        start, *installed, end = file.read_text().splitlines()
        assert (start, end) == ("#!/bin/sh", line)
        assert not installed or file.name == "colcon"
        assert file.stat().st_mode & 0o111 == 0o111


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_what_it_says_is_one_line_of_commands_that_are_there(name: str) -> None:
    text = instead_of(name)
    assert "\n" not in text
    for quoted in text.split("'rosz ")[1:]:
        word = quoted.partition("'")[0].split()[0]
        assert word in OWN or word == "--version"


def test_a_command_in_the_shell(network: Network) -> None:
    done = evaluate(network, "rosdep install x; rosmake all; wstool update")
    lines = done.stderr.splitlines()
    names = "rosdep", "rosmake", "wstool"
    assert lines == [f"ERROR: rosz has no '{name}': {instead_of(name)}" for name in names]
    assert (done.returncode, done.stdout) == (2, "")


def test_a_command_that_the_machine_has_goes_first(network: Network) -> None:
    own = network.folder / "own"
    own.mkdir()
    (own / "gazebo").write_text("#!/bin/sh\necho the real one\n")
    (own / "gazebo").chmod(0o755)
    done = evaluate(network, "gazebo", ROSZ_PYTHON="", HOME=str(network.folder))
    assert "rosz has no 'gazebo'" in done.stderr
    done = evaluate(network, f'PATH="{own}:$PATH"; eval "$({sys.executable} -m rosz env)"; gazebo')
    assert (done.stdout, done.stderr) == ("the real one\n", "")


@pytest.mark.parametrize("name", ["usb_cam", "rqt_anything", "gazebo_ros"])
def test_a_program_of_a_package(network: Network, name: str) -> None:
    done = evaluate(network, f"rosrun {name} {name}")
    assert done.returncode == 1
    assert done.stderr.startswith(f"ERROR: package '{name}' not found (searched ")
    assert done.stderr.endswith(f"; rosz does not have it: {instead_of(name)}\n")
    assert done.stderr.count("\n") == 1


def test_a_package_in_a_launch_file(network: Network) -> None:
    file = network.folder / "a.launch"
    file.write_text('<launch><include file="$(find gazebo_ros)/launch/empty.launch"/></launch>')
    done = evaluate(network, "roslaunch --nodes a.launch")
    assert done.returncode == 1
    assert "a.launch:1:24: package 'gazebo_ros' not found" in done.stderr
    assert instead_of("gazebo_ros") in done.stderr


def test_an_unknown_package_says_how_packages_are_found(network: Network) -> None:
    done = evaluate(network, "rosrun nope nope")
    assert "a package is a folder with a package.xml, below ROSZ_PACKAGE_PATH" in done.stderr


@pytest.mark.parametrize("name", ["moveit_commander"])
def test_a_module(network: Network, name: str) -> None:
    program = network.program(f"import rosz.ros1; import {name}")
    assert program.exit_code() == 1
    last = program.lines[-1]
    assert last == (
        f"ModuleNotFoundError: No module named '{name}': rosz does not have it: {instead_of(name)}"
    )


def test_a_package_of_the_user_with_such_a_name_is_imported(network: Network) -> None:
    folder = network.folder / "src" / "moveit_commander" / "src" / "moveit_commander"
    folder.mkdir(parents=True)
    (folder.parents[1] / "package.xml").write_text(
        "<package><name>moveit_commander</name></package>"
    )
    (folder / "__init__.py").write_text("OWN = True\n")
    (folder.parents[1] / "msg").mkdir()
    (folder.parents[1] / "msg" / "A.msg").write_text("int8 a\n")
    program = network.program(
        "import rosz.ros1; import moveit_commander; print(moveit_commander.OWN)",
        ROSZ_PACKAGE_PATH=str(network.folder / "src"),
    )
    assert (program.exit_code(), program.lines) == (0, ["True"])
