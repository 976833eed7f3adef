"""Plans: additions to roslaunch, warnings that it does not give, and the plan as a value."""

from __future__ import annotations

import json
import time

import msgspec
import pytest

from rosz.errors import LaunchFileError, NotFoundError
from rosz.launch.plan import Condition, LaunchText, Place, Plan, plan

from .fake_context import FakeContext, plan_of

NODE = '<node pkg="p" type="t" name="n" {}/>'


def condition(kind: str, name: str) -> Condition:
    return msgspec.convert({"kind": kind, "name": name}, Condition)


def test_waits_of_groups_and_nodes_add_up() -> None:
    found = plan_of(
        '<group ns="g" wait_for="topic scan" wait_timeout="5">'
        + NODE.format('wait_for="service /s | node ~x, param p" spawn_delay="1.5"')
        + "</group>"
        + NODE.format("")
    )
    inner, outer = found.nodes
    assert [(wait.any_of, wait.timeout) for wait in inner.wait_for] == [
        ((condition("topic", "/g/scan"),), 5.0),
        ((condition("service", "/s"), condition("node", "/g/n/x")), 30.0),
        ((condition("param", "/g/p"),), 30.0),
    ]
    assert inner.spawn_delay == 1.5
    assert inner.wait_for[1].place == inner.place
    assert (outer.wait_for, outer.spawn_delay, outer.respawn_max) == ((), 0.0, None)


def test_respawn_max_is_a_whole_number() -> None:
    assert plan_of(NODE.format('respawn="true" respawn_max="3"')).nodes[0].respawn_max == 3


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        (
            'wait_for=""',
            "f:1:51: 'wait_for' has ''; expected a kind and a name, as in 'topic /scan'",
        ),
        ('wait_for="topic a,"', "f:1:51: 'wait_for' has ''; expected a kind and a name"),
        ('wait_for="/scan"', "f:1:51: 'wait_for' has '/scan'; expected a kind and a name"),
        ('wait_for="topik /scan"', "f:1:51: 'wait_for' has no kind 'topik'; did you mean 'topic'?"),
        ('wait_for="x /scan"', "'x'; there are topic, service, param, node"),
        ('wait_for="topic 0"', "'wait_for': '0' is not a valid name"),
        (
            'wait_for="topic a" wait_timeout="-1"',
            "f:1:74: 'wait_timeout' is '-1'; expected a number",
        ),
        ('spawn_delay="soon"', "f:1:54: 'spawn_delay' is 'soon'; expected a number of at least 0"),
        ('spawn_delay="nan"', "'spawn_delay' is 'nan'"),
        ('respawn_max="-1"', "'respawn_max' is '-1'; expected 0 or more"),
        ('respawn_max="1.5"', "'respawn_max' is '1.5'; expected a whole number"),
    ],
)
def test_wrong_additions_are_refused(attributes: str, message: str) -> None:
    with pytest.raises(LaunchFileError) as caught:
        plan_of(NODE.format(attributes))
    assert message in str(caught.value)


def test_a_group_has_no_private_names_to_wait_for() -> None:
    with pytest.raises(LaunchFileError, match="a group has no private names"):
        plan_of('<group wait_for="topic ~x"/>')


def test_a_timeout_without_a_wait_is_a_warning() -> None:
    found = plan_of(NODE.format('wait_timeout="3"'))
    assert [str(warning) for warning in found.warnings] == [
        "f:1:55: 'wait_timeout' does nothing without 'wait_for'"
    ]


def test_ros2_spellings_of_a_node() -> None:
    found = plan_of(
        '<node pkg="p" exec="talker.py" namespace="a"/><node pkg="p" exec="x" name="y"/>'
    )
    assert [(node.full_name, node.type) for node in found.nodes] == [
        ("/a/talker", "talker.py"),
        ("/y", "x"),
    ]
    assert not found.warnings


def test_roslaunch_spelling_wins_over_that_of_ros2() -> None:
    found = plan_of('<node pkg="p" type="t" exec="e" name="n" ns="a" namespace="b"/>')
    assert (found.nodes[0].type, found.nodes[0].namespace) == ("t", "/a")
    assert ["ignored beside" in warning.text for warning in found.warnings] == [True, True]


def test_let_and_var() -> None:
    found = plan_of(
        '<arg name="a" default="1" description="what it is"/>'
        '<group><let name="a" value="2"/><let name="b" value="3"/>'
        '<param name="in" value="$(var a)$(var b)"/></group>'
        '<param name="out" value="$(eval var(\'a\') + 1)"/>'
    )
    assert [(param.name, param.value) for param in found.params] == [("/in", 23), ("/out", 2)]


@pytest.mark.parametrize(
    "value", ["$(env A)", "$(optenv A)", "$(optenv A x)", "$(eval env('A'))", "$(eval optenv('A'))"]
)
def test_substitutions_see_what_set_env_sets(value: str) -> None:
    text = f'<set_env name="A" value="b"/><group><param name="p" value="{value}"/></group>'
    assert [one.value for one in plan_of(text).params] == ["b"]


def test_substitutions_see_set_env_in_its_scope_alone() -> None:
    group = '<group><set_env name="A" value="b"/></group>'
    for text in group, '<env name="A" value="b"/>':  # roslaunch's <env> is for nodes alone
        with pytest.raises(LaunchFileError, match="variable 'A' is not set"):
            plan_of(f'{text}<param name="p" value="$(env A)"/>')


def test_set_env_is_env() -> None:
    assert plan_of('<set_env name="A" value="1"/>' + NODE.format("")).nodes[0].env == (("A", "1"),)


@pytest.mark.parametrize("tag", ["push_ros_namespace", "push-ros-namespace"])
def test_push_ros_namespace_ends_with_its_group(tag: str) -> None:
    found = plan_of(
        f'<group><{tag} namespace="a"/><{tag} namespace="b"/><param name="p" value="1"/></group>'
        f'<{tag} namespace="/c"/><include file="inc"/>{NODE.format("")}',
        FakeContext({"inc": f'<launch><{tag} namespace="d"/><param name="p" value="1"/></launch>'}),
    )
    assert [param.name for param in found.params] == ["/a/b/p", "/c/d/p"]
    assert found.nodes[0].full_name == "/c/n"


def test_find_pkg_share_keeps_the_text_that_follows() -> None:
    found = plan_of(
        '<param name="a" value="$(find-pkg-share robot)x y"/>'
        '<param name="b" value="$(find robot)x y"/>'
    )
    assert [param.value for param in found.params] == ["/src/robotx y", "/src/robot/x y"]


def test_find_prefers_built_programs() -> None:
    found = plan_of('<param name="a" value="$(find robot)/src/driver -v"/>')
    assert found.params[0].value == "/devel/lib/robot/driver -v"


def test_executables_are_not_nodes() -> None:
    found = plan_of(
        '<group ns="g"><env name="A" value="1"/>'
        '<executable cmd="echo \'a b\'" args="c" cwd="/tmp" output="screen" respawn="true">'
        '<env name="B" value="2"/><param name="x"/></executable>'
        '<executable cmd="/bin/echo again"/><executable cmd="rviz" name="view"/></group>'
    )
    first, second, third = found.nodes
    assert (first.command, first.args, first.cwd) == (("echo", "a b"), ("c",), "/tmp")
    assert (first.full_name, first.named, first.output, first.respawn) == (
        *("/g/echo", False),
        *("screen", True),
    )
    assert first.env == (("A", "1"), ("B", "2"))
    assert (second.full_name, third.full_name, third.named) == ("/g/echo_2", "/g/view", True)
    assert [warning.text for warning in found.warnings] == [
        "<param> means nothing in <executable>; it is allowed in <group>, <launch>, <node>, <test>"
    ]


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("<executable/>", "f:1:9: <executable> needs the attribute 'cmd'"),
        ('<executable cmd=""/>', "f:1:26: 'cmd' is empty"),
        ('<executable cmd="a \'"/>', "f:1:26: 'cmd' cannot be split: no closing quotation"),
        ('<executable cmd="a" name="x"/>' * 2, "two nodes are named '/x'"),
        ('<let name="a"/>', "f:1:9: <let> needs the attribute 'value'"),
        ('<push_ros_namespace namespace="~"/>', "f:1:40: namespace '~' is private"),
        ('<node pkg="p" name="n"/>', "f:1:9: <node> needs the attribute 'type'"),
        ('<node pkg="p"/>', "f:1:9: <node> needs the attribute 'type'"),
        ('<param name="a" value="$(var b)"/>', "f:1:32: arg 'b' is not set"),
    ],
)
def test_wrong_ros2_tags_are_refused(body: str, message: str) -> None:
    with pytest.raises(LaunchFileError) as caught:
        plan_of(body)
    assert message in str(caught.value)


ROS2_FILE = "/g/n: {ros__parameters: {a.b: 2}}\n/**: {ros__parameters: {a: {b: 1, c: 1}}}"


def test_parameter_files_of_ros2_are_for_nodes() -> None:
    outside = FakeContext({"p.yaml": ROS2_FILE})
    node = '<node pkg="p" type="t" name="{}"><rosparam file="p.yaml"/></node>'
    found = plan_of(f'<group ns="g">{node.format("n")}</group>{node.format("m")}', outside)
    assert {param.name: param.value for param in found.params} == {
        "/g/n/a/b": 2,
        "/g/n/a/c": 1,
        "/m/a/b": 1,
        "/m/a/c": 1,
    }
    with pytest.raises(LaunchFileError) as caught:
        plan_of('<rosparam file="p.yaml"/>', outside)
    assert "p.yaml:1:1: '/**' in this parameter file of ROS 2 means any node" in str(caught.value)


def test_warnings_have_the_place_of_their_cause() -> None:
    outside = FakeContext(
        {"inc": '<launch>\n<nod/>\n  <node pkg="p" type="t" name="n" respwan="1"/></launch>'}
    )
    found = plan_of(
        '<Node/><master/><arg nam="x" name="a" default="1"/><group foo="1"/><bogus/>'
        '<remap from="a" to="b"/><param name="p" value="a$(arg b"/>'
        '<param name="q" value="1"/><param name="q/r" value="1"/><rosparam param="~x">1</rosparam>'
        '<include file="inc"/>',
        outside,
        a="2",
        aa="3",
    )
    assert [str(warning) for warning in found.warnings] == [
        "f:1:9: <Node> means nothing in <launch>; did you mean 'node'?",
        "f:1:16: <master> has no meaning any more",
        "f:1:35: <arg> has no attribute 'nam'; did you mean 'name'?",
        "f:1:72: <group> has no attribute 'foo'; it has by_reference, clear_params, container, if, "
        "namespace, ns, unless, "
        "wait_for, wait_timeout",
        "f:1:76: <bogus> is not a launch file tag; <launch> may hold <arg>, <env>, <executable>, "
        "<group>, <include>, <let>, <machine>, <node>, <param>, <push-ros-namespace>, "
        "<push_ros_namespace>, <remap>, <rosparam>, <set_env>, <test>",
        "f:1:132: '$(' is never closed, so it stays as it is",
        "f:1:169: parameter '/q/r' turns '/q', set at f:1:142, into a dict",
        "f:1:198: '~x' is private to the launcher here, not to a node; write it without '~'",
        "inc:2:1: <nod> means nothing in <launch>; did you mean 'node'?",
        "inc:3:44: <node> has no attribute 'respwan'; did you mean 'respawn'?",
        "<command line>: no file declares an arg 'aa', so 'aa:=…' does nothing; did you mean 'a'?",
    ]
    assert found.warnings[8].place.includes == ("f:1:231",)
    assert found.unused_args == ("aa",)
    assert found.params[-1].target == "/roslaunch/x"


def test_a_value_that_hides_others_is_a_warning() -> None:
    found = plan_of('<param name="a/b" value="1"/><param name="a" value="2"/>')
    assert [warning.text for warning in found.warnings] == [
        "parameter '/a' and '/a/b' below it are both set"
    ]


def test_errors_carry_the_chain_of_includes() -> None:
    outside = FakeContext(
        {
            "/a": '<launch><group>\n <include file="/b"/></group></launch>',
            "/b": '<launch>\n\n<param name="x" value="é$(arg y)"/></launch>',
        }
    )
    with pytest.raises(LaunchFileError) as caught:
        plan_of('<include file="/a"/>', outside)
    error = caught.value
    assert (error.path, error.line, error.column) == ("/b", 3, 25)
    assert error.includes == ("f:1:9", "/a:2:2")
    assert str(error) == (
        "/b:3:25: arg 'y' is not set; declare it before: <arg name='y' default='…'/>\n"
        "  included from /a:2:2\n  included from f:1:9"
    )


def test_long_chains_of_includes_are_shortened() -> None:
    outside = FakeContext({"/x": '<launch><include file="/x"/></launch>'})
    with pytest.raises(
        LaunchFileError, match="nest deeper than 300; '/x' includes itself"
    ) as caught:
        plan_of('<include file="/x"/>', outside)
    assert len(caught.value.includes) == 13
    assert "… 288 more" in caught.value.includes


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({}, "f:1:24: '/x.py' cannot be read: No such file or directory; launch files in Python"),
        (
            {"/x.py": "import launch"},
            "f:1:24: '/x.py' is not XML; launch files are read as XML only",
        ),
    ],
)
def test_other_kinds_of_launch_files_are_named(files: dict[str, str], message: str) -> None:
    with pytest.raises(LaunchFileError) as caught:
        plan_of('<include file="/x.py"/>', FakeContext(files))
    assert message in str(caught.value)


def test_commands_run_only_where_wanted() -> None:
    outside = FakeContext()
    found = plan_of(
        '<param name="a" command="echo 1 2"/><param if="0" name="b" command="echo no"/>', outside
    )
    assert (found.params[0].value, outside.ran) == ("1 2", [["echo", "1", "2"]])


def test_failed_commands_are_refused() -> None:
    with pytest.raises(LaunchFileError, match="f:1:34: command 'fail' ended with code 3"):
        plan_of('<param name="a" command="fail"/>')


@pytest.mark.parametrize(
    ("param", "reason"),
    [
        ('name="" value="1"', "the root of all parameters takes no value"),
        ('name="/" value="1"', "the root of all parameters takes no value"),
        ('name="big" type="int" value="99999999999999999999"', "parameter '/big': the int"),
        ('name="none" type="yaml" value="~"', "null"),
    ],
)
def test_values_that_are_not_parameters_are_refused(param: str, reason: str) -> None:
    with pytest.raises(LaunchFileError) as caught:
        plan_of(f"<param {param}/>")
    assert reason in caught.value.reason


@pytest.mark.parametrize(
    ("before", "each", "after"),
    [
        ("", '<param name="p{}" value="1"/>', ""),
        (NODE.format("")[:-2] + ">", '<param name="p{}" value="1"/>', "</node>"),
        ("", '<param name="~p{}" value="1"/>', NODE.format("")),
        ("<rosparam>", "p{}: 1\n", "</rosparam>"),
    ],
    ids=["global", "of a node", "private", "YAML"],
)
def test_fifty_thousand_parameters_are_read_fast(before: str, each: str, after: str) -> None:
    """The time grows with their number, and not with its square: that took half a minute."""
    text = before + "".join(map(each.format, range(50_000))) + after
    began = time.thread_time()
    assert len(plan_of(text).params) == 50_000
    assert time.thread_time() - began < 12


def test_the_log_collector_keeps_its_name() -> None:
    with pytest.raises(LaunchFileError, match="'/rosout' is the name of ROS's own log collector"):
        plan_of('<node pkg="p" type="t" name="rosout"/>')


def test_several_files_make_one_plan() -> None:
    outside = FakeContext(
        {
            "a.launch": '<launch><arg name="x"/><machine name="m" address="h" default="true"/>'
            '<param name="p" value="$(arg x)"/></launch>',
            "/b.launch": '<launch><node pkg="p" type="t" name="n"/></launch>',
        }
    )
    found = plan(
        ["a.launch", "/b.launch", "a.launch", LaunchText(b"<launch><arg name='x'/></launch>")],
        {"x": "7"},
        outside,
        ns="r",
    )
    assert found.files == ("/work/a.launch", "/b.launch")
    assert [(param.name, param.value) for param in found.params] == [("/r/p", 7)]
    assert found.node("/r/n").machine == ""
    assert not found.warnings


def test_files_that_cannot_be_read_are_named() -> None:
    with pytest.raises(LaunchFileError, match=r"nope\.launch: cannot be read: No such file"):
        plan(["nope.launch"], {}, FakeContext())


def test_the_same_name_in_two_files_is_refused() -> None:
    text = '<launch><node pkg="p" type="t" name="n"/></launch>'
    with pytest.raises(LaunchFileError, match="two nodes are named '/n', the other at a:1:9"):
        plan([LaunchText(text, "a"), LaunchText(text, "b")], {}, FakeContext())


def test_a_plan_is_json() -> None:
    found = plan_of(
        '<param name="b" type="yaml" value="{x: [1, 2.5, !!binary aGk=, 2020-01-01]}"/>'
        + NODE.format('wait_for="topic a"')
    )
    read = json.loads(found.to_json())
    assert read["params"] == [
        {
            "name": "/b",
            "value": {"x": [1, 2.5, "aGk=", "2020-01-01"]},
            "place": {"file": "f", "line": 1, "column": 9, "includes": []},
        }
    ]
    assert msgspec.json.decode(found.to_json(), type=Plan).nodes == found.nodes


def test_a_plan_finds_its_parts() -> None:
    found = plan_of('<machine name="m" address="h"/>' + NODE.format('machine="m"'))
    assert found.node("/n").place == Place("f", 1, 40)
    assert found.machine("") is None
    machine = found.machine("m")
    assert machine is not None
    assert machine.address == "h"
    with pytest.raises(NotFoundError, match="no node '/m' in this launch; the nodes are /n"):
        found.node("/m")
    with pytest.raises(NotFoundError, match="the launch has no nodes"):
        Plan().node("/m")
    with pytest.raises(NotFoundError, match="no machine 'x'"):
        found.machine("x")
