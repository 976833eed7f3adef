"""rclpy's values: times, durations, profiles, parameters, command lines."""

from __future__ import annotations

from enum import Enum
from pathlib import Path

import pytest

from rosz.errors import DecodeError, NotFoundError, UsageError, YamlError
from rosz.msgs.builtin_interfaces.msg import Duration as DurationMessage
from rosz.msgs.builtin_interfaces.msg import Time as TimeMessage
from rosz.msgs.std_msgs.msg import String
from rosz.qos import QoS
from rosz.ros2.rclpy import program, qos
from rosz.ros2.rclpy.arguments import parse, remove_ros_args
from rosz.ros2.rclpy.parameter import Parameter, get_parameter_value
from rosz.ros2.rclpy.time import ClockType, Duration, Infinite, Time

Type = Parameter.Type


def test_serialized_messages() -> None:
    message = String(data="text")
    data = program.serialize_message(message)
    assert data[:4] == b"\x00\x01\x00\x00"
    assert program.deserialize_message(data, String) == message
    with pytest.raises(DecodeError):
        program.deserialize_message(data[:6], String)


def test_durations() -> None:
    assert Duration(seconds=1.5, nanoseconds=2).nanoseconds == 1_500_000_002
    assert Duration(seconds=-1.5).to_msg() == DurationMessage(-2, 500_000_000)
    assert Duration.from_msg(DurationMessage(-2, 500_000_000)) == Duration(seconds=-1.5)
    assert Duration(seconds=1) < Duration(seconds=2) <= Duration(seconds=2) < Infinite
    assert str(Duration(seconds=1)) == "1000000000 nanoseconds"


def test_times() -> None:
    time = Time(seconds=10, nanoseconds=5, clock_type=ClockType.ROS_TIME)
    assert time.seconds_nanoseconds() == (10, 5)
    assert time.to_msg() == TimeMessage(10, 5)
    assert Time.from_msg(time.to_msg()) == time
    assert time + Duration(seconds=1) - time == Duration(seconds=1)
    assert (time - Duration(seconds=1)).nanoseconds == 9_000_000_005
    assert time > time - Duration(nanoseconds=1)
    with pytest.raises(TypeError, match="different clocks"):
        _ = time < Time(seconds=10)
    with pytest.raises(ValueError, match="negative"):
        Time(seconds=-1)


def test_profiles() -> None:
    assert qos.to_qos(7) == QoS(depth=7)
    assert qos.to_qos(qos.qos_profile_sensor_data) == QoS(depth=5, reliability="best_effort")
    profile = qos.QoSProfile(
        depth=1,
        durability=qos.DurabilityPolicy.TRANSIENT_LOCAL,
        deadline=Duration(seconds=1),
        history=qos.QoSHistoryPolicy.KEEP_LAST,
    )
    assert qos.to_qos(profile) == QoS(1, durability="transient_local", deadline=10**9)
    assert qos.QoSPresetProfiles.SENSOR_DATA.value == qos.qos_profile_sensor_data
    assert profile != qos.qos_profile_sensor_data
    with pytest.raises(UsageError, match="a history or a depth"):
        qos.QoSProfile()
    with pytest.raises(UsageError, match="no 'reliable'"):
        qos.QoSProfile(depth=1, reliable=True)
    with pytest.raises(UsageError, match="got str"):
        qos.to_qos("reliable")  # type: ignore[arg-type]


def test_older_names_of_policies() -> None:
    names = vars(qos.QoSReliabilityPolicy)
    assert names["RMW_QOS_POLICY_RELIABILITY_RELIABLE"] is qos.ReliabilityPolicy.RELIABLE
    assert "RMW_QOS_POLICY_DURABILITY_VOLATILE" in vars(qos.DurabilityPolicy)
    assert [policy.name for policy in qos.HistoryPolicy][1:3] == ["KEEP_LAST", "KEEP_ALL"]


class _Text(str, Enum):  # noqa: UP042  # its text is not its value
    MAP = "map"


class _Number(float):
    pass


@pytest.mark.parametrize(
    ("value", "plain", "kind"),
    [
        (qos.ReliabilityPolicy.BEST_EFFORT, 2, Type.INTEGER),
        (_Text.MAP, "map", Type.STRING),
        (_Number(1.5), 1.5, Type.DOUBLE),
        ([_Number(1), 2.0], [1.0, 2.0], Type.DOUBLE_ARRAY),
        ((_Text.MAP,), ("map",), Type.STRING_ARRAY),
    ],
)
def test_parameters_of_derived_types(value: object, plain: object, kind: Type) -> None:
    parameter = Parameter("p", value=value)
    assert (parameter.value, parameter.type_) == (plain, kind)
    assert "class '_" not in repr(type(parameter.value))
    assert Type.from_parameter_value(value) is kind


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (None, Type.NOT_SET), (True, Type.BOOL), (1, Type.INTEGER), (1.0, Type.DOUBLE),
        ("a", Type.STRING), (b"a", Type.BYTE_ARRAY), ([True], Type.BOOL_ARRAY),
        ([1, 2], Type.INTEGER_ARRAY), ([1.0], Type.DOUBLE_ARRAY), (["a"], Type.STRING_ARRAY),
    ],
)  # fmt: skip
def test_parameters(value: object, kind: Parameter.Type) -> None:
    parameter = Parameter("p", value=value)
    assert parameter.type_ is kind
    again = Parameter.from_parameter_msg(parameter.to_parameter_msg())
    assert (again.name, again.type_, again.value) == ("p", kind, value)


def test_invalid_parameter_values() -> None:
    for value in ({"a": 1}, [1, "a"], object()):
        with pytest.raises(UsageError, match="a parameter cannot be"):
            Parameter("p", value=value)
    with pytest.raises(UsageError, match="expected one of type DOUBLE"):
        Parameter("p", Type.DOUBLE, "fast")
    assert get_parameter_value("[1.5, 2.5]").type == Type.DOUBLE_ARRAY


def test_command_lines() -> None:
    found = parse(
        [
            "word",
            "a:=b",
            "--ros-args",
            "-r",
            "c:=d",
            "-r",
            "__node:=me",
            "--remap",
            "__ns:=/ns",
            "-p",
            "x:=1.5",
            "-p",
            "n:y:=[a]",
            "--log-level",
            "debug",
            "--enable-rosout-logs",
            "--",
            "more",
        ]
    )
    assert found.arguments.remaps == {"a": "b", "c": "d"}
    assert found.arguments.special == {"__name": "me", "__ns": "/ns"}
    assert found.params == {"": {"x": 1.5}, "n": {"y": ["a"]}}
    assert (found.level, found.rest) == ("debug", ("word", "more"))
    assert remove_ros_args(["p", "--ros-args", "-r", "a:=b", "--", "c"]) == ["p", "c"]


def test_ros1_parameters_on_the_command_line() -> None:
    assert parse(["_speed:=2", "__name:=me"]).params == {"": {"speed": 2}}


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("--ros-args -x a", "'-x' is not a ROS argument"),
        ("--ros-args -p a", "expected name:=value"),
        ("--ros-args -p", "is the last argument"),
        ("--ros-args -p a:=[", "is not YAML"),
        ("--ros-args -p a:=2020-13-45", "is not YAML: '2020-13-45' is not a !!timestamp"),
        (f"--ros-args -p a:={'[' * 20_000}", "nested more than 100 deep"),
    ],
)
def test_wrong_command_lines(words: str, text: str) -> None:
    with pytest.raises(UsageError, match=text.replace("[", r"\[")):
        parse(words.split())


def test_parameter_files(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(
        "/**: {ros__parameters: {all: 1}}\n"
        "arm:\n  ros__parameters: {pid: {p: 1.0, i: 2.0}}\n"
        "/ns:\n  hand: {ros__parameters: {grip: true}}\n"
    )
    found = parse(["--ros-args", "--params-file", str(file)]).params
    assert found == {
        "": {"all": 1},
        "arm": {"pid.p": 1.0, "pid.i": 2.0},
        "/ns/hand": {"grip": True},
    }
    with pytest.raises(NotFoundError, match="nowhere"):
        parse(["--ros-args", "--params-file", "/nowhere"])
    for content in (b"a: 1", b"a: {ros__parameters: 1}", b"a: {ros__parameters: [}", b"\xff"):
        file.write_bytes(content)
        with pytest.raises(YamlError, match=r"ros__parameters|p\.yaml"):
            parse(["--ros-args", "--params-file", str(file)])
