"""``rosz pkg``: packages are listed, found, and made."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from .command import package, rosz


def test_list_and_find(tmp_path: Path) -> None:
    path = package(tmp_path / "src", "demo")
    listed = rosz(tmp_path, "pkg", "list").stdout.splitlines()
    assert f"demo {path}" in listed
    assert any(line.startswith("std_msgs ") for line in listed)
    assert listed == sorted(listed)
    names = rosz(tmp_path, "pkg", "list", "--names").stdout.splitlines()
    assert names == [line.split()[0] for line in listed]
    as_json = json.loads(rosz(tmp_path, "pkg", "list", "--json").stdout)
    assert as_json["demo"] == str(path)
    assert list(as_json) == names
    assert rosz(tmp_path, "pkg", "find", "demo").stdout == f"{path}\n"


def test_missing_things(tmp_path: Path) -> None:
    package(tmp_path / "src", "demo")
    done = rosz(tmp_path, "pkg", "find", "dmo")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert done.stderr.endswith("did you mean 'demo'?\n")


def test_create(tmp_path: Path) -> None:
    done = rosz(tmp_path, "pkg", "create", "my_pkg", "std_msgs", "rospy", "a&b", "-m", "Me <x>")
    folder = tmp_path / "my_pkg"
    assert done.stdout == (
        f"created {folder}\nrun it with: rosz launch {folder}/launch/talker.launch\n"
    )
    assert done.stderr == "WARNING: dependency 'a&b' is not on the package path\n"
    files = sorted(str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_file())
    assert files == ["launch/talker.launch", "msg/Number.msg", "package.xml", "scripts/talker.py"]
    assert os.access(folder / "scripts/talker.py", os.X_OK)
    manifest = (folder / "package.xml").read_text()
    assert "<depend>a&amp;b</depend>" in manifest
    assert '<maintainer email="user@example.com">Me &lt;x&gt;</maintainer>' in manifest
    assert rosz(folder, "pkg", "find", "my_pkg").stdout == f"{folder}\n"
    shown = rosz(tmp_path, "launch", "--args", "/talker", f"{folder}/launch/talker.launch")
    assert shown.stdout == f"{folder}/scripts/talker.py __name:=talker\n"


@pytest.mark.parametrize("name", ["My_pkg", "9a", "a-b", "a/b", "", "ünder"])
def test_invalid_names(tmp_path: Path, name: str) -> None:
    done = rosz(tmp_path, "pkg", "create", name)
    assert done.returncode == 2
    assert done.stderr == (
        f"ERROR: '{name}' is not a valid package name; expected lower-case letters, digits and"
        " '_', a letter first\n"
    )
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    done = rosz(tmp_path, "pkg", "create", "taken")
    assert done.returncode == 1
    assert done.stderr == f"ERROR: '{tmp_path}/taken' exists already; choose another name\n"


@pytest.mark.parametrize("dependencies", [(), ("std_msgs",), ("rospy",), ("roscpp", "std_msgs")])
def test_a_bare_package_is_that_of_catkin(tmp_path: Path, dependencies: tuple[str, ...]) -> None:
    def content() -> list[str]:
        return sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*"))

    done = rosz(tmp_path, "pkg", "create", "--bare", "bare", *dependencies)
    made = content()
    if not Path("/usr/bin/catkin_create_pkg").exists():
        pytest.skip("no catkin_create_pkg to compare with (Debian: python3-catkin-pkg)")
    shutil.rmtree(tmp_path / "bare")
    real = subprocess.run(
        ["/usr/bin/catkin_create_pkg", "bare", *dependencies],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert (done.stdout, made) == (real.stdout, content())
