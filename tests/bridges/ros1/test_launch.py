"""A launch with roscpp programs beside rospy scripts, and wrappers of both."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, Program
from oracle import PYTHON, is_installed

from rosz.environment import Environment, package_index
from rosz.msgs.std_msgs.msg import String

from .world import LISTENER, roscpp

pytestmark = [pytest.mark.ros1, pytest.mark.system]

_LAUNCH = """<launch>
  <machine name="here" address="localhost"/>
  <node pkg="course" type="partner" name="talker" machine="here" args="talker" respawn="true"/>
  <node pkg="course" type="listener.py" name="listener" args="x chatter" output="screen"/>
  <node pkg="course" type="compiled" name="compiled" output="screen"/>
  <node pkg="course" type="scripted" name="scripted" output="screen"/>
  <node pkg="course" type="partner" name="last" args="server" required="true"/>
</launch>
"""
_MANIFEST = """<package format="2"><name>{}</name><version>1.0.0</version>
<description>x</description><maintainer email="me@example.com">x</maintainer>
<license>BSD</license>{}</package>"""
_WRAPPERS = {
    "compiled": '#!/bin/sh\nrosrun course partner listener "$@"\n',
    "scripted": '#!/bin/sh\nexec "$(dirname "$0")/listener.py" x chatter "$@"\n',
}


def _workspace(top: Path, program: str) -> Path:
    """Write a workspace of catkin with a package whose program is in the devel space."""
    package, devel = top / "src" / "course", top / "devel"
    package.mkdir(parents=True)
    (package / "package.xml").write_text(_MANIFEST.format("course", ""))
    (package / "both.launch").write_text(_LAUNCH)
    scripts = {"listener.py": f"#!/usr/bin/env python3\n{LISTENER}", **_WRAPPERS}
    for name, text in scripts.items():
        (package / name).write_text(text)
        (package / name).chmod(0o755)
    (devel / "lib" / "course").mkdir(parents=True)
    (devel / "share" / "course").mkdir(parents=True)
    (devel / ".catkin").write_text(str(top / "src"))
    shutil.copy(program, devel / "lib" / "course" / "partner")
    return package


def _pid(launch: Program, name: str) -> int:
    text = launch.output
    return int(re.findall(rf"process\[{name}-\d+\]: started with pid \[(\d+)\]", text)[-1])


def test_programs_and_wrappers_of_them_get_their_master(network: Network, tmp_path: Path) -> None:
    package = _workspace(tmp_path, roscpp())
    launch = network.run(
        "-m",
        "rosz",
        "launch",
        "--prefix",
        str(package / "both.launch"),
        ROSZ_PACKAGE_PATH=str(tmp_path / "src"),
        PATH=os.pathsep.join([str(Path(sys.executable).parent), os.defpath]),
        PYTHONUNBUFFERED="1",
    )
    launch.wait_for(
        "nodes not in Python (talker, compiled, scripted, last) have this launch's ROS 1 master"
    )
    for name in ("listener", "compiled", "scripted"):
        launch.wait_for(re.compile(rf"{name}.*heard talker "))
    os.kill(_pid(launch, "talker"), signal.SIGKILL)
    launch.wait_for(re.compile(r"\[talker-\d+\] restarting process"))
    launch.wait_for(re.compile(r"process\[talker-\d+\]: started"), times=2)
    launch.wait_for("heard talker ", after=len(launch.lines))
    os.kill(_pid(launch, "last"), signal.SIGKILL)
    assert launch.exit_code() == 1
    assert "REQUIRED process [last-" in launch.output


_HEADERS = [Path("/usr/include") / part for part in ("pluginlib", "class_loader", "rcpputils")]


@pytest.mark.skipif(
    not all(part.is_dir() for part in (*_HEADERS, Path("/usr/include/nodelet"))),
    reason="needs nodelets (Debian: libnodeletlib-dev, libnodeletlib-tools)",
)
def test_a_manager_loads_nodelets(network: Network, tmp_path: Path) -> None:
    include = [f"-I{part}" for part in (*_HEADERS, Path("/usr/include/rcutils"))]
    library = roscpp("relays", "std_msgs", "bondcpp", options=("-shared", "-fPIC", *include))
    package, devel = tmp_path / "src" / "relays", tmp_path / "devel"
    package.mkdir(parents=True)
    (devel / "lib").mkdir(parents=True)
    (devel / ".catkin").write_text(str(tmp_path / "src"))
    shutil.copy(library, devel / "lib" / "librelays.so")
    export = '<depend>nodelet</depend><export><nodelet plugin="${prefix}/nodelets.xml"/></export>'
    (package / "package.xml").write_text(_MANIFEST.format("relays", export))
    (package / "nodelets.xml").write_text(
        '<library path="lib/librelays"><class name="relays/Capitals" type="relays::Capitals"'
        ' base_class_type="nodelet::Nodelet"/></library>'
    )
    node = '<node pkg="nodelet" type="nodelet" output="screen"'
    (package / "both.launch").write_text(
        f'<launch>{node} name="manager" args="manager"/>'
        f'{node} name="capitals" args="load relays/Capitals manager"/></launch>'
    )
    launch = network.run(
        "-m",
        "rosz",
        "launch",
        str(package / "both.launch"),
        ROS_PACKAGE_PATH=f"{tmp_path / 'src'}:/usr/share",
        CMAKE_PREFIX_PATH=f"{devel}:/usr",
        PYTHONUNBUFFERED="1",
    )
    heard: SimpleQueue[Any] = SimpleQueue()
    neighbour = network.node("neighbour")
    neighbour.subscription("/capitals/out", String, heard.put)
    neighbour.publisher("/capitals/in", String, latch=True).publish("from rosz")
    try:
        assert heard.get(timeout=4 * TIMEOUT).data == "FROM ROSZ"
    except Empty:
        pytest.fail(launch.output)
    pids = [_pid(launch, name) for name in ("manager", "capitals")]
    launch.send(signal.SIGINT)
    assert launch.exit_code(2 * TIMEOUT) == 0
    assert not [pid for pid in pids if Path(f"/proc/{pid}").exists()]


@pytest.mark.skipif(not is_installed("roslib"), reason="needs roslib (Debian: python3-roslib)")
@pytest.mark.parametrize("sourced", [True, False])
def test_programs_are_found_where_roslaunch_finds_them(tmp_path: Path, *, sourced: bool) -> None:
    package = _workspace(tmp_path, "/bin/true")
    installed = tmp_path / "install" / "lib" / "course" / "partner"
    installed.parent.mkdir(parents=True)
    shutil.copy("/bin/false", installed)
    isolated = tmp_path / "devel_isolated" / "course" / "lib" / "course" / "alone"
    isolated.parent.mkdir(parents=True)
    shutil.copy("/bin/true", isolated)
    variables = {
        "PATH": os.defpath,
        "HOME": str(tmp_path),
        "ROS_PACKAGE_PATH": str(tmp_path / "src"),
        "CMAKE_PREFIX_PATH": f"/usr:{tmp_path / 'devel'}",
    }
    wanted = [("course", "partner"), ("course", "listener.py"), ("nodelet", "nodelet")]
    script = (
        "import sys, roslib.packages as r\n"
        "for word in sys.argv[1:]:\n"
        "    try: print((r.find_node(*word.split('/')) or [''])[0])\n"
        "    except r.rospkg.ResourceNotFound: print('')\n"
    )
    words = ["/".join(each) for each in wanted]
    found = subprocess.run(
        [PYTHON, "-c", script, *words],
        env=variables,
        check=True,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
    ).stdout.splitlines()
    if not sourced:
        del variables["CMAKE_PREFIX_PATH"], variables["ROS_PACKAGE_PATH"]
    index = package_index(Environment.read(variables, package))
    for (name, program), expected in zip(wanted, found, strict=True):
        if expected:
            assert str(index.find(name).executable(program)) == expected
    assert index.find("course").executable("partner").is_relative_to(tmp_path / "devel")
    if not sourced:
        (tmp_path / "devel").rename(tmp_path / "removed")
        assert index.find("course").executable("alone") == isolated
        assert index.find("course").executable("partner") == installed
