"""rospkg and roslib, compared with the real ones where possible."""

from __future__ import annotations

import stat
import sys
from pathlib import Path

import pytest
from oracle import same

from rosz.ros1.tools import rospkg
from rosz.ros1.tools.roslib import packages as roslib

ARM = """<package format="2">
  <name>arm</name>
  <version>1.2.3</version>
  <description>Moves
    an arm</description>
  <maintainer email="ann@example.com">Ann</maintainer>
  <author>Bob</author>
  <license>BSD</license>
  <license>MIT</license>
  <url>http://example.com</url>
  <buildtool_depend>catkin</buildtool_depend>
  <depend>hand</depend>
  <exec_depend>libfoo</exec_depend>
  <export><plugin lib="${prefix}/lib"/></export>
</package>
"""


def make(root: Path, name: str, text: str = "") -> Path:
    folder = root / name
    folder.mkdir(parents=True)
    text = text or f"<package><name>{name}</name><version>0.1.0</version></package>"
    (folder / "package.xml").write_text(text)
    return folder


@pytest.fixture
def packs(tmp_path: Path) -> rospkg.RosPack:
    make(tmp_path, "arm", ARM)
    make(tmp_path, "hand", "<package><name>hand</name><run_depend>finger</run_depend></package>")
    make(tmp_path / "deep" / "down", "finger")
    return rospkg.RosPack([str(tmp_path)])


def test_find_packages(packs: rospkg.RosPack, tmp_path: Path) -> None:
    assert sorted(packs.list()) == ["arm", "finger", "hand"]
    assert packs.get_path("finger") == str(tmp_path / "deep" / "down" / "finger")
    assert packs.ros_paths == packs.get_ros_paths() == [str(tmp_path)]


@pytest.mark.ros1
def test_error_of_a_missing_package(tmp_path: Path) -> None:
    same(
        f"""
        import rospkg
        try:
            rospkg.RosPack(["{tmp_path}", "/nowhere"]).get_path("leg")
        except rospkg.ResourceNotFound as error:
            result = [str(error), error.args, list(error.ros_paths)]
        """,
        "rospkg",
        "python3-rospkg",
    )


def test_manifest(packs: rospkg.RosPack, tmp_path: Path) -> None:
    found = packs.get_manifest("arm")
    assert (found.name, found.version, found.description) == ("arm", "1.2.3", "Moves an arm")
    assert (found.license, found.url) == ("BSD, MIT", "http://example.com")
    assert found.author == "Maintainer: Ann <ann@example.com>, Bob"
    assert [depend.name for depend in found.depends] == ["hand"]
    assert [dep.name for dep in found.rosdeps] == ["catkin", "libfoo"]
    assert found.get_export("plugin", "lib") == [f"{tmp_path}/arm/lib"]
    assert found.is_catkin


@pytest.mark.ros1
@pytest.mark.usefixtures("packs")
def test_manifest_equals_that_of_rospkg(tmp_path: Path) -> None:
    same(
        f"""
        import rospkg
        found = rospkg.RosPack(["{tmp_path}"]).get_manifest("arm")
        result = [
            found.version, found.author, found.license, found.licenses, found.url, found.is_catkin,
            [(one.tag, one.get("lib"), one.get("x")) for one in found.exports],
            found.get_export("plugin", "lib"), found.get_export("plugin", "lib", convert=False),
        ]
        """,
        "rospkg",
        "python3-rospkg",
    )


def test_dependencies(packs: rospkg.RosPack) -> None:
    assert packs.get_depends("arm") == ["hand", "finger"]
    assert packs.get_depends("arm", implicit=False) == ["hand"]
    assert packs.get_depends_on("finger") == ["arm", "hand"]
    assert packs.get_depends_on("finger", implicit=False) == ["hand"]
    assert packs.get_rosdeps("arm") == ["catkin", "libfoo"]
    with pytest.raises(rospkg.ResourceNotFound):
        packs.get_depends("leg")


def test_a_broken_manifest_is_named(tmp_path: Path) -> None:
    make(tmp_path, "arm", "<package><name>arm</name>")
    with pytest.raises(rospkg.InvalidManifest, match=r"arm/package\.xml"):
        rospkg.RosPack([str(tmp_path)]).get_path("arm")
    make(tmp_path, "hand")
    assert rospkg.RosPack([str(tmp_path)]).list() == ["hand"]


@pytest.mark.usefixtures("packs")
def test_package_of_a_file(tmp_path: Path) -> None:
    inside = tmp_path / "arm" / "scripts"
    inside.mkdir()
    assert rospkg.get_package_name(str(inside / "run.py")) == "arm"
    assert rospkg.get_package_name("/") is None
    assert roslib.get_dir_pkg(str(inside)) == (str(tmp_path / "arm"), "arm")
    assert roslib.get_dir_pkg("/") == (None, None)


def test_shipped_packages_are_found() -> None:
    assert "std_msgs" in rospkg.RosPack().list()
    assert Path(rospkg.RosPack().get_path("std_msgs"), "msg", "String.msg").is_file()
    assert roslib.get_pkg_dir("std_msgs") == rospkg.RosPack().get_path("std_msgs")


@pytest.mark.ros1
def test_folders_of_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("ROS_HOME", "ROS_LOG_DIR", "ROS_ROOT", "ROS_TEST_RESULTS_DIR", "ROS_ETC_DIR"):
        monkeypatch.delenv(name, raising=False)
    same(
        """
        import rospkg
        from rospkg import environment
        env = {"ROS_HOME": "/h", "ROS_ROOT": "/r"}
        result = [
            rospkg.get_ros_home(env), rospkg.get_log_dir(env), rospkg.get_test_results_dir(env),
            rospkg.get_ros_root(env), rospkg.get_etc_ros_dir(env),
            rospkg.get_log_dir({"ROS_LOG_DIR": "/l"}),
            sorted(name for name in vars(environment) if name.startswith("ROS_")),
            environment.get_ros_root({environment.ROS_ROOT: "/r"}),
        ]
        """,
        "rospkg",
        "python3-rospkg",
    )


def test_pkg_dir_of_a_missing_package() -> None:
    assert roslib.get_pkg_dir("no_such_thing", required=False) is None
    with pytest.raises(roslib.InvalidROSPkgException, match="'no_such_thing' not found"):
        roslib.get_pkg_dir("no_such_thing")


def test_files_of_a_package(packs: rospkg.RosPack, tmp_path: Path) -> None:
    script = tmp_path / "arm" / "scripts" / "move.py"
    script.parent.mkdir()
    script.write_text("#!/usr/bin/env python\n")
    assert roslib.find_resource("arm", "move.py", rospack=packs) == [str(script)]
    assert roslib.find_node("arm", "move.py", packs) == []
    script.chmod(script.stat().st_mode | stat.S_IXUSR)
    assert roslib.find_node("arm", "move.py", packs) == [str(script)]
    with pytest.raises(rospkg.ResourceNotFound):
        roslib.find_resource("leg", "move.py", rospack=packs)


def test_load_manifest_extends_the_module_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", list(sys.path))
    before = list(sys.path)
    for name in ("rospy", "roslib", "rosbag"):
        roslib.load_manifest(name)
    assert sys.path == before
    roslib.load_manifest("std_msgs")
    with pytest.raises(rospkg.ResourceNotFound):
        roslib.load_manifest("no_such_thing")
    code = make(tmp_path, "arm", ARM) / "src"
    code.mkdir()
    monkeypatch.setattr(roslib, "RosPack", lambda: rospkg.RosPack([str(tmp_path)]))
    roslib.load_manifest("arm")
    roslib.load_manifest("arm")
    assert sys.path == [str(code), *before]


def test_a_manager_finds_what_rospack_finds() -> None:
    manager = rospkg.ManifestManager(rospkg.PACKAGE_FILE)
    assert isinstance(rospkg.RosPack(), rospkg.ManifestManager)
    assert manager.get_path("turtlesim") == rospkg.RosPack().get_path("turtlesim")
    assert not hasattr(manager, "get_rosdeps")
