"""Manifests and stacks of rosbuild, read as by the real roslib."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from oracle import ours, real

from rosz.ros1.roslib import rosenv, stacks
from rosz.ros1.roslib.manifestlib import Depend, Platform, StackDepend
from rosz.ros1.roslib.packages import ROSEnvException, load_manifest

_MANIFESTS = '''
from roslib import manifest, manifestlib, stack_manifest
TEXTS = [
    """<package><description brief="b">two
lines</description><author>A</author><author>B</author><license url="u">BSD</license>
<url>http://x</url><logo>l</logo><review status="s" notes="n"/>
<depend package="roscpp"/><depend thirdparty="x"/><rosdep name="python"/>
<platform os="ubuntu" version="8.04"/><versioncontrol type="git" url="v"/>
<export><cpp cflags="-I"/><cpp lflags="-l">text</cpp></export><other/></package>""",
    "<package/>", "<package><version>1.2</version></package>",
    "<stack/>", "no xml", "<package><depend/></package>",
    "<package><url>a</url><url>b</url></package>",
    "<stack><depend stack='a'/><version> 1 </version></stack>",
    "<stack><rosdep name='a'/></stack>", "<stack><export><cpp/></export></stack>",
]
result = []
for text in TEXTS:
    for parse in (manifest.parse, stack_manifest.parse):
        try:
            m = parse(text)
        except manifestlib.ManifestException:
            result.append("refused")
            continue
        result.append([m.description or "", m.brief, m.author, m.license, m.license_url,
                       m.url or "", m.version or "", m.logo or "", m.status, m.notes,
                       [str(one) for one in m.depends], [one.name for one in m.rosdeps],
                       [[one.os, one.version, one.notes] for one in m.platforms],
                       [[one.tag, one.attrs, one.str] for one in m.exports],
                       m.versioncontrol and m.versioncontrol.xml(), len(m.unknown_tags),
                       m.get_export("cpp", "cflags")])
'''


@pytest.mark.ros1
def test_manifests_are_read_as_by_roslib() -> None:
    assert ours(_MANIFESTS) == real(_MANIFESTS, "roslib.manifestlib", "python3-roslib")


def test_a_manifest_is_written_as_it_was_read() -> None:
    space: dict[str, object] = {}
    code = _MANIFESTS.partition("result = []")[0] + (
        "first = manifest.parse(TEXTS[0])\n"
        "second = manifest.parse(first.xml())\n"
        "same = first.xml() == second.xml()\n"
        "known = second.exports[1].str, second.depends\n"
    )
    import rosz.ros1  # noqa: F401  # for the names of ROS 1

    exec(code, space)
    assert space["same"]
    assert space["known"] == ("text", [Depend("roscpp")])


def test_entries() -> None:
    assert Depend("a") == Depend("a") != StackDepend("a")
    assert Platform("u", "1", "n").xml() == '<platform os="u" version="1" notes="n"/>'
    with pytest.raises(ValueError, match="bad 'package' attribute"):
        Depend("")


def test_stacks_of_a_package_path(tmp_path: Path) -> None:
    for name, text in (("one", "<stack><version>1.0</version></stack>"), ("two", "<stack/>")):
        folder = tmp_path / "below" / name
        (folder / "tool").mkdir(parents=True)
        (folder / "stack.xml").write_text(text)
        (folder / "tool" / "manifest.xml").write_text("<package/>")
    recipe = tmp_path / "below" / "two" / "CMakeLists.txt"
    recipe.write_text("# by hand\nrosbuild_make_distribution(2.5)\n")
    env = {"ROS_PACKAGE_PATH": str(tmp_path)}
    assert sorted(stacks.list_stacks(env)) == ["one", "two"]
    assert stacks.get_stack_dir("one", env) == str(tmp_path / "below" / "one")
    assert stacks.get_stack_version("one", env) == "1.0"
    assert stacks.get_stack_version("two", env) == "2.5"
    assert stacks.expand_to_packages(["one", "nothing"], env) == (["tool"], ["nothing"])
    with pytest.raises(stacks.InvalidROSStackException, match="three"):
        stacks.get_stack_dir("three", env)


def test_required_variables() -> None:
    assert rosenv.get_ros_root(required=False, env={}) is None
    assert rosenv.get_master_uri(env={}, argv=["x", "__master:=http://a:1"]) == "http://a:1"
    with pytest.raises(ROSEnvException, match="ROS_PACKAGE_PATH has not been configured"):
        rosenv.get_ros_package_path(required=True, env={})
    with pytest.raises(ROSEnvException, match="__master"):
        rosenv.get_master_uri(required=False, env={}, argv=["__master:="])


def test_load_manifest_of_rosbuild(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    depends = '<depend package="rospy"/><depend package="roscpp"/><depend package="other_of_it"/>'
    for name, text in (("load_it", depends), ("other_of_it", "")):
        (tmp_path / name / "src").mkdir(parents=True)
        (tmp_path / name / "manifest.xml").write_text(f"<package>{text}</package>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    monkeypatch.setattr(sys, "path", list(sys.path))
    load_manifest("load_it")
    assert sys.path[:2] == [str(tmp_path / name / "src") for name in ("load_it", "other_of_it")]
