"""The exact text of reports on plans."""

from __future__ import annotations

import pytest

from rosz.errors import LaunchError, NotFoundError
from rosz.launch.plan import ArgDoc, LaunchText, describe_args
from rosz.launch.run import report

from .fake_context import FakeContext, plan_of

NODES = (
    '<group ns="g"><env name="A" value="1 2"/><remap from="x" to="y"/>'
    '<node pkg="p" type="t" name="n" args="-v \'a b\'" launch-prefix="nice -n 5"/></group>'
    '<node pkg="p" type="t" name=""/>'
    '<node pkg="p" type="t" name="twin"/><test test-name="twin" pkg="p" type="t"/>'
    '<executable cmd="echo hi" args="you"/>'
)


def find(package: str, type_name: str) -> str:
    return f"/{package}/{type_name}"


def test_params_are_written_as_yaml() -> None:
    found = plan_of('<param name="b" value="1"/><rosparam>a: {c: [1, x], d: "1"}</rosparam>')
    assert report.dump_params(found) == "/a/c:\n- 1\n- x\n/a/d: '1'\n/b: 1\n"
    assert report.dump_params(plan_of("")) == "{}\n"


def test_binary_values_are_written_too() -> None:
    found = plan_of('<param name="b" binfile="/f"/>', FakeContext({"/f": "hi"}))
    assert report.dump_params(found) == "/b: !!binary |\n  aGk=\n"


def test_unnamed_nodes_are_not_listed() -> None:
    assert report.list_nodes(plan_of(NODES)) == "/g/n\n/twin\n/twin"


def test_files_are_listed_once() -> None:
    outside = FakeContext({"inc": "<launch/>", "./inc": "<launch/>"})
    found = plan_of('<include file="inc"/><include file="./inc"/>', outside)
    assert report.list_files(found) == "/work/inc"


def test_the_file_of_a_node() -> None:
    assert report.node_file(plan_of(NODES), "/g/n") == "f"
    assert report.node_file(plan_of(NODES), "n", ns="/g") == "f"
    with pytest.raises(NotFoundError, match="no node '/roslaunch/n'"):
        report.node_file(plan_of(NODES), "~n")


def test_a_name_that_is_not_unique_is_refused() -> None:
    with pytest.raises(LaunchError, match="there are several nodes '/twin': f:1:189, f:1:225"):
        report.node_args(plan_of(NODES), "/twin", find, {})


def test_the_command_of_a_node() -> None:
    found = plan_of(NODES)
    assert report.node_args(found, "/g/n", find, {}) == (
        'ROS_NAMESPACE="/g" A="1 2" nice -n 5 /p/t -v a b x:=y __name:=n'
    )
    assert report.node_args(found, "g/n", find, {"A": "1 2", "ROS_NAMESPACE": "/g"}) == (
        "nice -n 5 /p/t -v a b x:=y __name:=n"
    )
    assert report.node_args(found, "echo", find, {}) == "echo hi you"
    assert report.command_line(found.node("/g/n"), find)[4:6] == ["-v", "a b"]


def test_the_environment_of_a_node() -> None:
    found = plan_of(NODES)
    assert report.environment(found.node("/g/n")) == {"ROS_NAMESPACE": "/g", "A": "1 2"}
    assert report.environment(found.node("/echo")) == {}


def test_args_are_described() -> None:
    text = """<launch>
      <arg name="port" default="$(optenv NONE tty)" doc="where it is"/>
      <arg name="b"/><arg name="a" doc="needed"/><arg name="empty" default=""/>
      <arg name="fixed" value="1"/>
      <group><arg name="inner" default="1"/></group>
      <include file="/not/read"/><param name="x" value="$(arg b)"/>
    </launch>"""
    docs = describe_args([LaunchText(text)], {}, FakeContext())
    assert docs[0] == ArgDoc("port", "where it is", "tty")
    assert report.describe(docs) == (
        "Required Arguments:\n  a: needed\n  b: undocumented\n  empty: undocumented\n"
        'Optional Arguments:\n  port (default "tty"): where it is'
    )
    assert report.describe(()) == "No arguments."
