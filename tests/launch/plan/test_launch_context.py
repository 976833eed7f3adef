"""The files, packages and commands of this machine, as launch files see them."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from rosz.errors import LaunchError, LaunchFileError, PackageNotFound
from rosz.launch.plan import SystemContext, plan
from rosz.packages import PackageIndex


def package(folder: Path, name: str) -> Path:
    (folder / name).mkdir(parents=True)
    manifest = f"<package><name>{name}</name></package>"
    (folder / name / "package.xml").write_text(manifest)
    return folder / name


def executable(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    return path


def outside(folder: Path, root: Path | None = None) -> SystemContext:
    index = PackageIndex([root or folder])
    return SystemContext(index, {"A": "1", "PATH": "/usr/bin:/bin"}, folder, "{}_1".format)


def test_relative_paths_start_from_the_given_folder(tmp_path: Path) -> None:
    (tmp_path / "a.launch").write_text('<launch><param name="d" value="$(dirname)"/></launch>')
    found = plan(["a.launch"], {}, outside(tmp_path))
    assert found.files == (str(tmp_path / "a.launch"),)
    assert found.params[0].value == str(tmp_path)


def test_packages_are_found(tmp_path: Path) -> None:
    robot = package(tmp_path, "robot")
    assert outside(tmp_path).find("robot") == str(robot)
    with pytest.raises(PackageNotFound, match="did you mean 'robot'"):
        outside(tmp_path).find("robbot")


@pytest.mark.parametrize("space", ["devel", "install"])
def test_built_programs_are_found_beside_the_sources(tmp_path: Path, space: str) -> None:
    package(tmp_path / "src" / "stack", "robot")
    driver = executable(tmp_path / space / "lib" / "robot" / "driver")
    (tmp_path / space / "lib" / "robot" / "notes").write_text("")
    context = outside(tmp_path, tmp_path / "src")
    assert context.built("robot", "driver") == str(driver)
    assert context.built("robot", "notes") is None
    assert context.built("robot", "none") is None


def test_installed_programs_are_found(tmp_path: Path) -> None:
    package(tmp_path / "share", "robot")
    driver = executable(tmp_path / "lib" / "robot" / "driver")
    assert outside(tmp_path, tmp_path / "share").built("robot", "driver") == str(driver)


def test_commands_run_in_the_given_environment(tmp_path: Path) -> None:
    context = outside(tmp_path)
    assert context.run(["sh", "-c", "echo $A; pwd"]) == f"1\n{tmp_path}\n".encode()
    with pytest.raises(LaunchError, match="command 'sh -c exit 3' ended with code 3"):
        context.run(["sh", "-c", "exit 3"])
    with pytest.raises(FileNotFoundError):
        context.run(["/no/such/program"])


def test_a_command_without_end_is_ended(tmp_path: Path) -> None:
    with pytest.raises(LaunchError, match=r"command 'sh -c .*' writes more than 67108864 bytes"):
        outside(tmp_path).run(["sh", "-c", "echo $$ > pid; exec yes"])
    assert not Path("/proc", (tmp_path / "pid").read_text().strip()).exists()


READING = [
    '<param name="a" textfile="{}"/>',
    '<param name="a" binfile="{}"/>',
    '<rosparam file="{}"/>',
    '<include file="{}"/>',
]


@pytest.mark.parametrize("text", READING)
@pytest.mark.parametrize("name", ["pipe", "/dev/zero"])
def test_files_that_are_not_regular_are_refused(tmp_path: Path, text: str, name: str) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "a.launch").write_text(f"<launch>{text.format(name)}</launch>")
    where = rf"a\.launch:1:\d+: '{name}' cannot be read: it is not a regular file"
    with pytest.raises(LaunchFileError, match=where):
        plan(["a.launch"], {}, outside(tmp_path))


def test_an_empty_device_can_be_read(tmp_path: Path) -> None:
    (tmp_path / "a.launch").write_text('<launch><rosparam file="/dev/null"/></launch>')
    assert plan(["a.launch"], {}, outside(tmp_path)).params == ()


def test_a_file_without_end_is_refused(tmp_path: Path) -> None:
    with (tmp_path / "large").open("wb") as large:
        large.truncate(64 * 1024 * 1024 + 1)
    text = '<launch><param name="a" textfile="large"/></launch>'
    (tmp_path / "a.launch").write_text(text)
    with pytest.raises(LaunchFileError, match=r"a\.launch:1:35: 'large' .*: too large"):
        plan(["a.launch"], {}, outside(tmp_path))


def test_names_are_made_by_the_caller(tmp_path: Path) -> None:
    assert outside(tmp_path).anonymous("a") == "a_1"


def test_reading_a_launch_file_imports_only_what_it_needs() -> None:
    import subprocess

    code = "import sys, rosz.launch.plan, rosz.launch.run.report; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"asyncio", "shlex", "subprocess", "yaml", "zenoh"} & set(done.stdout.split())
