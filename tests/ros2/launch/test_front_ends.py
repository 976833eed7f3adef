"""Launch files of ROS 2 in XML and YAML become the plans of those in Python."""

from __future__ import annotations

import pytest

from ros2.conftest import Ros2
from rosz.errors import LaunchFileError
from rosz.launch.plan import Plan

from .conftest import Folder

XML = """\
<launch>
  <arg name="side" default="left" description="which one"><choice value="left"/></arg>
  <let name="both" value="$(var side)_$(var side)"/>
  <set_parameter name="use_sim_time" value="true"/>
  <node pkg="robot" exec="driver" name="$(var both)" namespace="arm" args="--fast 'a b'"
        output="screen" launch-prefix="nice"
        if="$(eval '&quot;$(var side)&quot; == &quot;left&quot;')">
    <param name="rate" value="2.5"/>
    <param name="label" value="5" type="str"/>
    <param name="gains"><param name="p" value="[1, 2]"/></param>
    <param from="$(find-pkg-share $(var pkg))/p.yaml" allow_substs="true"/>
    <remap from="scan" to="/laser"/>
    <env name="MODE" value="$(env MODE none)"/>
  </node>
  <group unless="false">
    <push_ros_namespace namespace="fleet"/>
    <set_remap from="a" to="b"/>
    <node pkg="robot" exec="other"/>
  </group>
  <executable cmd="echo $(dirname)" shell="false"/>
  <timer period="2"><log message="later"/></timer>
  <include file="$(dirname)/inner.launch.xml"><arg name="name" value="$(var side)"/></include>
</launch>
"""
YAML = """\
launch:
- arg: {name: side, default: left, description: which one, choice: [{value: left}]}
- let: {name: both, value: $(var side)_$(var side)}
- set_parameter: {name: use_sim_time, value: true}
- node:
    pkg: robot
    exec: driver
    name: $(var both)
    namespace: arm
    args: --fast 'a b'
    output: screen
    launch-prefix: nice
    if: $(eval '"$(var side)" == "left"')
    param:
    - {name: rate, value: 2.5}
    - {name: label, value: "5", type: str}
    - name: gains
      param: [{name: p, value: [1, 2]}]
    - {from: $(find-pkg-share $(var pkg))/p.yaml, allow_substs: true}
    remap: [{from: scan, to: /laser}]
    env: [{name: MODE, value: $(env MODE none)}]
- group:
    unless: false
    children:
    - push_ros_namespace: {namespace: fleet}
    - set_remap: {from: a, to: b}
    - node: {pkg: robot, exec: other}
- executable: {cmd: echo $(dirname), shell: false}
- timer: {period: 2, children: [log: {message: later}]}
- include: {file: $(dirname)/inner.launch.xml, arg: [{name: name, value: $(var side)}]}
"""
INNER = '<launch><arg name="name"/><node pkg="robot" exec="in" name="$(var name)"/></launch>'


def read(folder: Folder, name: str, text: str) -> Plan:
    folder.write("inner.launch.xml", INNER)
    folder.write("p.yaml", "/**: {ros__parameters: {side: $(var side)}}\n")
    return folder.read(folder.write(name, text), pkg="robot")


@pytest.mark.pure
@pytest.mark.parametrize(("name", "text"), [("x.launch.xml", XML), ("x.launch.yaml", YAML)])
def test_tags_become_actions(folder: Folder, name: str, text: str) -> None:
    plan = read(folder, name, text)
    names = ["/arm/left_left", "/fleet/other", "/echo", "/left"]
    assert [node.full_name for node in plan.nodes] == names
    driver, other, echo, _ = plan.nodes
    assert (driver.args, driver.output, driver.launch_prefix) == (
        ("--fast", "a b"),
        "screen",
        ("nice",),
    )
    assert (driver.remaps, driver.env) == ((("scan", "/laser"),), (("MODE", "none"),))
    assert driver.ros_params == (
        {"use_sim_time": True},
        {"rate": 2.5},
        {"label": "5"},
        {"gains.p": [1, 2]},
        {"side": "left"},
    )
    assert (other.remaps, other.named) == ((("a", "b"),), False)
    assert echo.command == ("echo", str(folder.path))
    assert [(step.text, step.delay) for step in plan.steps] == [("later", 2.0)]
    assert driver.place.line == (5 if name.endswith("xml") else 6)


@pytest.mark.pure
@pytest.mark.parametrize(
    ("name", "text", "error"),
    [
        (
            "x.xml",
            "<launch><nod/></launch>",
            "x.xml:1:9: <nod> is not a tag of ROS 2; did you mean 'node'?",
        ),
        (
            "x.xml",
            '<launch>\n<log message="$(vra x)"/></launch>',
            "x.xml:2:1: '$(vra x)' is not a substitution; did you mean 'var'?",
        ),
        (
            "x.xml",
            '<launch>\n<log message="$(var x"/></launch>',
            "x.xml:2:1: '$(var x' is not a substitution; ')' is missing",
        ),
        ("x.xml", '<launch>\n<node pkg="a"/></launch>', "x.xml:2:1: Node needs 'executable'"),
        (
            "x.xml",
            '<launch>\n<let name="a"/></launch>',
            "x.xml:2:1: TypeError: missing a required argument: 'value'",
        ),
        (
            "x.yaml",
            "launch:\n- node: {pkg: a, exce: b}\n",
            "x.yaml:2:9: Node takes no 'exce' in rosz",
        ),
        (
            "x.xml",
            "<launch><include/></launch>",
            "x.xml:1:9: <include>, or a tag in it, needs 'file'",
        ),
        ("x.yaml", "- node: {}\n", "x.yaml: the file has to hold one list, named 'launch'"),
        (
            "x.yaml",
            "launch: [\n",
            "x.yaml:2:1: not YAML: expected the node content, but found '<stream end>'",
        ),
    ],
)
def test_errors_have_their_place(folder: Folder, name: str, text: str, error: str) -> None:
    folder.write(name, text)
    with pytest.raises(LaunchFileError) as caught:
        folder.read(name)
    assert str(caught.value) == error


def test_the_commands_know_such_files(ros2: Ros2) -> None:
    program = '<executable cmd="echo said $(var a)" output="screen"/>'
    text = f'<launch><arg name="a" default="b"/>{program}</launch>'
    (ros2.network.folder / "x_launch.xml").write_text(text)
    (ros2.network.folder / "x_launch.yaml").write_text(
        "launch:\n- arg: {name: a, default: b}\n"
        "- executable: {cmd: echo said $(var a), output: screen}\n"
    )
    for name in ("x_launch.xml", "x_launch.yaml"):
        done = ros2("launch", name, "a:=hi")
        assert (done.code, "said hi" in done.out) == (0, True), done.err
        assert "(default: 'b')" in ros2("launch", "-s", name).out
