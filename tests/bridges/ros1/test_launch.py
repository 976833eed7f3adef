"""A launch with a roscpp program beside a rospy script."""

from __future__ import annotations

import shutil
import signal
from pathlib import Path

import pytest
from network import Network

from .world import LISTENER, roscpp

pytestmark = [pytest.mark.ros1, pytest.mark.system]

_LAUNCH = """<launch>
  <node pkg="course" type="partner" name="talker" args="talker"/>
  <node pkg="course" type="listener.py" name="listener" args="x chatter" output="screen"/>
</launch>
"""


def _package(folder: Path) -> Path:
    folder.mkdir(parents=True)
    manifest = "<package format='2'><name>course</name><version>1.0.0</version></package>"
    (folder / "package.xml").write_text(manifest)
    (folder / "both.launch").write_text(_LAUNCH)
    shutil.copy(roscpp(), folder / "partner")
    script = folder / "listener.py"
    script.write_text(f"#!/usr/bin/env python3\n{LISTENER}")
    script.chmod(0o755)
    return folder


def test_compiled_nodes_get_their_master(network: Network, tmp_path: Path) -> None:
    package = _package(tmp_path / "course")
    launch = network.run(
        "-m",
        "rosz",
        "launch",
        str(package / "both.launch"),
        ROSZ_PACKAGE_PATH=str(tmp_path),
    )
    launch.wait_for("compiled nodes (talker) have this launch's ROS 1 master http://127.0.0.1:")
    launch.wait_for("heard talker ")
    launch.send(signal.SIGINT)
    assert launch.exit_code() == 0
