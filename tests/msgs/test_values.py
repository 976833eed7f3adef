"""Conversions to and from dicts, JSON and YAML."""

from __future__ import annotations

import json
import math
import random
from array import array
from typing import Any

import pytest

from rosz.errors import EncodeError
from rosz.message import Message
from rosz.message.convert import from_json, from_plain, from_yaml, to_json, to_plain, to_yaml
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Point, PoseStamped, Twist, Vector3
from rosz.msgs.rcl_interfaces.msg import ParameterValue
from rosz.msgs.sensor_msgs.msg import CameraInfo, Image, JointState, LaserScan
from rosz.msgs.std_msgs.msg import Byte, Float64, Header, Int8, String, UInt8, UInt8MultiArray
from rosz.typestore import TypeStore

from . import values

STORE = TypeStore()
NAMES = STORE.names("msg")


@pytest.mark.parametrize("name", NAMES)
def test_there_and_back(name: str) -> None:
    rng = random.Random(name)
    cls = STORE.message(name)
    spec = STORE._catalog.message(cls._type_name)
    for _ in range(3):
        plain = values.value(rng, STORE._catalog, spec)
        message = values.build(cls, plain)
        data = message.to_cdr()
        assert values.same(to_plain(message), plain)
        assert from_plain(cls, plain).to_cdr() == data
        assert from_json(cls, to_json(message)).to_cdr() == data
        assert json.loads(to_json(message), parse_constant=pytest.fail) is not None
        assert from_yaml(cls, to_yaml(cls.from_cdr(data))).to_cdr() == data


def test_plain_form() -> None:
    header = Header(5, Time(1, 2), "map")
    assert to_plain(header) == {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "map"}
    joints = JointState(name=["a"], position=array("d", [1.0]), velocity=[2.0])
    plain = to_plain(joints)
    assert (plain["name"], plain["position"], plain["velocity"]) == (["a"], [1.0], [2.0])
    assert to_plain(UInt8MultiArray(data=bytearray(b"12")))["data"] == b"12"


def test_json_form() -> None:
    assert to_json(Image(data=b"abc")).endswith('"data": "YWJj"}')
    assert to_json(Float64(math.inf)) == '{"data": "Infinity"}'
    assert from_json(Float64, '{"data": "-Infinity"}').data == -math.inf
    assert math.isnan(from_json(Float64, '{"data": "NaN"}').data)
    assert to_json(String("é\n")) == '{"data": "é\\n"}'


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{linear: {x: 1.0}}", Twist(Vector3(1.0))),
        ("linear: {x: 1}\nangular: {z: -2}", Twist(Vector3(1.0), Vector3(0.0, 0.0, -2.0))),
        ("[[1, 2, 3], [0, 0, 1e-5]]", Twist(Vector3(1.0, 2.0, 3.0), Vector3(0.0, 0.0, 1e-5))),
        ("[{x: 1}, {z: .inf}]", Twist(Vector3(1.0), Vector3(0.0, 0.0, math.inf))),
        ("", Twist()),
        ("{}", Twist()),
        ("{linear: }", Twist()),
    ],
)
def test_command_line_forms(text: str, expected: Twist) -> None:
    assert from_yaml(Twist, text) == expected


def test_the_only_field_needs_no_name() -> None:
    assert from_yaml(String, "hello") == String("hello")
    assert from_yaml(String, "'5'") == String("5")
    assert from_yaml(Float64, "5") == Float64(5.0)
    assert from_yaml(Float64, "1e3") == Float64(1000.0)


def test_now_and_auto() -> None:
    def now() -> Time:
        return Time(5, 6)

    assert from_yaml(PoseStamped, "{header: auto}", now).header == Header(0, Time(5, 6))
    stamped = from_yaml(PoseStamped, "header: {stamp: now, frame_id: map}", Time(7, 8))
    assert stamped.header == Header(0, Time(7, 8), "map")
    with pytest.raises(EncodeError, match=r"header: expected std_msgs/Header, got str 'auto'"):
        from_yaml(PoseStamped, "{header: auto}")


def test_spellings_of_ros_1() -> None:
    assert from_yaml(Header, "{seq: 3, stamp: {secs: 1, nsecs: 2}}") == Header(0, Time(1, 2))
    assert from_yaml(Header, "{seq: 3}").seq == 3
    assert list(from_yaml(CameraInfo, "{K: [1,2,3,4,5,6,7,8,9]}").k) == [*range(1, 10)]


def test_other_ways_to_write_a_value() -> None:
    assert from_yaml(UInt8MultiArray, "{data: !!binary YWJj}").data == b"abc"
    assert from_yaml(UInt8MultiArray, "{data: YWJj}").data == b"abc"
    assert from_yaml(Byte, "-1").data == -1
    assert from_plain(Byte, {"data": b"\7"}).data == 7
    assert from_plain(Twist, [Vector3(1.0), [0, 0, 0]]).linear == Vector3(1.0)


BAD: list[tuple[type[Message], str, str]] = [
    (Twist, "{linear: {y: a}}", "geometry_msgs/Twist.linear.y: expected float64, got str 'a'"),
    (Twist, "{linear: {y: true}}", "geometry_msgs/Twist.linear.y: expected float64, got bool True"),
    (Twist, "{a: [}", "geometry_msgs/Twist: not YAML: while parsing a flow node"),
    (Float64, "data: " + "[" * 20_000, "std_msgs/Float64: not YAML: maximum recursion depth"),
    (Float64, "2001-13-45", "std_msgs/Float64: not YAML: month must be in 1..12"),
    (Float64, "!!timestamp x", "std_msgs/Float64: not YAML: "),
    (
        Float64,
        "1" + "0" * 400,
        "std_msgs/Float64.data: expected float64 in its range, got int 1000",
    ),
    (
        Twist,
        "5",
        "expected 2 values for the fields (linear, angular), got 1",
    ),
    (Point, "{x: }", "geometry_msgs/Point.x: expected float64, got nothing"),
    (String, "5", "std_msgs/String.data: expected string (quote it: \"'5'\"), got int 5"),
    (String, "[[a]]", "std_msgs/String.data: expected string, got list ['a']"),
    (UInt8, "-1", "std_msgs/UInt8.data: expected uint8 (0 to 255), got int -1"),
    (Int8, "128", "std_msgs/Int8.data: expected int8 (-128 to 127), got int 128"),
    (Int8, "1.0", "std_msgs/Int8.data: expected int8, got float 1.0"),
    (Byte, "256", "std_msgs/Byte.data: expected byte (-128 to 255), got int 256"),
    (
        Image,
        "{data: [1, 300]}",
        "sensor_msgs/Image.data[1]: expected uint8 (0 to 255), got int 300",
    ),
    (Image, "{data: 'no base 64'}", "sensor_msgs/Image.data: expected a list of octets, or Base64"),
    (JointState, "{name: foo}", "JointState.name: expected a list of string, got str 'foo'"),
    (JointState, "{name: [a, 1]}", "JointState.name[1]: expected string (quote it: \"'1'\")"),
    (JointState, "{position: [1, b]}", "JointState.position[1]: expected float64, got str 'b'"),
    (
        LaserScan,
        "{ranges: [1.0e+39]}",
        "LaserScan.ranges: expected elements in the range of float32, got list [1e+39]",
    ),
    (CameraInfo, "{K: [1]}", "sensor_msgs/CameraInfo.K: expected 9 elements, got list [1]"),
    (Header, "{stamp: 1.5}", "Header.stamp: expected nanoseconds as an integer"),
    (ParameterValue, "{bool_value: maybe}", "bool_value: expected bool, got str 'maybe'"),
    (
        ParameterValue,
        "{bool_array_value: [true, 2]}",
        "bool_array_value[1]: expected bool, got int 2",
    ),
]


@pytest.mark.parametrize(("cls", "text", "expected"), BAD, ids=lambda value: str(value)[:40])
def test_errors_name_the_field(cls: type[Message], text: str, expected: str) -> None:
    with pytest.raises(EncodeError) as caught:
        from_yaml(cls, text)
    assert expected in str(caught.value)


def test_no_json() -> None:
    with pytest.raises(EncodeError, match=r"std_msgs/String: not JSON: Expecting value: line 1"):
        from_json(String, "{'a'}"[2:])
    bad: Any = b"\xff"
    for text in (bad, "[" * 100_000):
        with pytest.raises(EncodeError, match="not JSON"):
            from_json(String, text)
