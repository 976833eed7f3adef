"""Packages of rosbuild, which have a manifest.xml."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from rosz.ros1.tools import rospkg
from rosz.ros1.tools.roslib import packages


def test_stacks_of_a_package_path(tmp_path: Path) -> None:
    for name in ("one", "two"):
        folder = tmp_path / "below" / name
        (folder / "tool").mkdir(parents=True)
        (folder / "stack.xml").write_text("<stack/>")
        (folder / "tool" / "manifest.xml").write_text("<package/>")
    stacks = rospkg.RosStack([str(tmp_path)])
    assert sorted(stacks.list()) == ["one", "two"]
    assert stacks.get_path("one") == str(tmp_path / "below" / "one")
    assert stacks.packages_of("one") == ["tool"]
    with pytest.raises(rospkg.ResourceNotFound, match="three"):
        stacks.get_path("three")


def test_load_manifest_of_rosbuild(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    depends = '<depend package="rospy"/><depend package="roscpp"/><depend package="other_of_it"/>'
    for name, text in (("load_it", depends), ("other_of_it", "")):
        (tmp_path / name / "src").mkdir(parents=True)
        (tmp_path / name / "manifest.xml").write_text(f"<package>{text}</package>")
    monkeypatch.setattr(packages, "RosPack", lambda: rospkg.RosPack([str(tmp_path)]))
    monkeypatch.setattr(sys, "path", list(sys.path))
    packages.load_manifest("load_it")
    assert sys.path[:2] == [str(tmp_path / name / "src") for name in ("load_it", "other_of_it")]
