"""What is acceptable as a value of a field, and what is said of the rest."""

from __future__ import annotations

import math
from array import array
from typing import Any

import numpy as np
import pytest

from rosz.errors import EncodeError
from rosz.message import Message
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import (
    Point,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovariance,
    Twist,
    Vector3,
)
from rosz.msgs.rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, ParameterValue
from rosz.msgs.sensor_msgs.msg import Image, JointState, LaserScan
from rosz.msgs.std_msgs.msg import (
    Bool,
    Byte,
    Char,
    ColorRGBA,
    Float32,
    Float64,
    Header,
    Int8,
    Int8MultiArray,
    Int32,
    Int32MultiArray,
    String,
    UInt8MultiArray,
    UInt64,
)
from rosz.msgs.unique_identifier_msgs.msg import UUID

from .invented import Written

WIDE = Written("wstring a\nwstring<=2 b\nwstring[] c")
BOUNDED = Written(
    "string<=3 a\nstring<=3[<=2] b\nuint8[<=2] c\nfloat64[<=2] d\nP[<=1] e", P="bool x"
)
anything: Any = object()


class Odd:
    def __repr__(self) -> str:
        return "<odd>"


odd: Any = Odd()

BAD: list[tuple[Message, str]] = [
    (Float64(odd), "std_msgs/Float64.data: expected float64, got Odd <odd>"),
    (Float64("1"), "std_msgs/Float64.data: expected float64, got str '1'"),  # type: ignore[arg-type]
    (Float64(None), "std_msgs/Float64.data: expected float64, got NoneType None"),  # type: ignore[arg-type]
    (Float32(1e39), "std_msgs/Float32.data: expected float32, got float 1e+39: float too large"),
    (Int32(1.5), "std_msgs/Int32.data: expected int32, got float 1.5"),  # type: ignore[arg-type]
    (
        Int32(1 << 31),
        "std_msgs/Int32.data: expected int32, got int 2147483648: 'i' format requires",
    ),
    (Int8(-129), "std_msgs/Int8.data: expected int8, got int -129: byte format requires -128 <="),
    (UInt64(-1), "std_msgs/UInt64.data: expected uint64, got int -1: "),
    (Char(256), "std_msgs/Char.data: expected char, got int 256: "),
    (Byte(-129), "std_msgs/Byte.data: expected byte, got int -129: "),
    (Byte(b"ab"), "std_msgs/Byte.data: expected byte, got bytes b'ab'"),  # type: ignore[arg-type]
    (String(5), "std_msgs/String.data: expected string, got int 5"),  # type: ignore[arg-type]
    (String("a\0b"), "std_msgs/String.data: expected string, got str 'a\\x00b': it holds a NUL"),
    (String("\ud800"), "std_msgs/String.data: expected string, got str '\\ud800': 'utf-8' codec"),
    (String(b"\xff"), "std_msgs/String.data: expected string, got bytes b'\\xff': 'utf-8'"),  # type: ignore[arg-type]
    (Twist(linear=odd), "Twist.linear: expected geometry_msgs/Vector3, got Odd <odd>: it has no"),
    (Twist(Vector3(y=odd)), "geometry_msgs/Twist.linear.y: expected float64, got Odd <odd>"),
    (
        PoseStamped(Header(frame_id=odd)),
        "geometry_msgs/PoseStamped.header.frame_id: expected string, got Odd <odd>",
    ),
    (
        PoseStamped(Header(Time(-1, 1 << 32))),
        "geometry_msgs/PoseStamped.header.stamp.nanosec: expected uint32, got int 4294967296",
    ),
    (
        PoseArray(poses=[Pose(), Pose(Point(z=odd))]),
        "geometry_msgs/PoseArray.poses[1].position.z: expected float64, got Odd <odd>",
    ),
    (
        PoseArray(poses=odd),
        "geometry_msgs/PoseArray.poses: expected a sequence of geometry_msgs/Pose",
    ),
    (PoseArray(poses=[1]), "poses[0]: expected geometry_msgs/Pose, got int 1: it has no field"),  # type: ignore[list-item]
    (
        PoseWithCovariance(covariance=[0.0] * 35),
        "geometry_msgs/PoseWithCovariance.covariance: expected 36 elements, got list [0.0,",
    ),
    (
        PoseWithCovariance(covariance=[*[0.0] * 35, odd]),
        "PoseWithCovariance.covariance[35]: expected float64, got Odd <odd>",
    ),
    (
        LaserScan(ranges=[1.0, "a"]),
        "sensor_msgs/LaserScan.ranges[1]: expected float32, got str 'a'",
    ),  # type: ignore[list-item]
    (LaserScan(ranges=[1.0, 1e39]), "LaserScan.ranges[1]: expected float32, got float 1e+39: "),
    (LaserScan(ranges=np.array([1e39])), "LaserScan.ranges[0]: expected float32, got float64 "),
    (LaserScan(ranges="abc"), "LaserScan.ranges: expected a sequence of float32, got str 'abc'"),  # type: ignore[arg-type]
    (LaserScan(ranges=5), "LaserScan.ranges: expected a sequence of float32, got int 5"),  # type: ignore[arg-type]
    (LaserScan(ranges={}), "LaserScan.ranges: expected a sequence of float32, got dict {}"),  # type: ignore[arg-type]
    (Int32MultiArray(data=[1, 2.5]), "Int32MultiArray.data[1]: expected int32, got float 2.5"),  # type: ignore[list-item]
    (Int32MultiArray(data=np.array([1.5])), "Int32MultiArray.data[0]: expected int32, got float64"),
    (
        Int32MultiArray(data=[1 << 40]),
        "Int32MultiArray.data[0]: expected int32, got int 1099511627776",
    ),
    (Int8MultiArray(data=np.array([200], np.uint8)), "Int8MultiArray.data[0]: expected int8, got"),
    (
        Int8MultiArray(data=b"ab"),
        "Int8MultiArray.data: expected a sequence of int8, got bytes b'ab'",
    ),  # type: ignore[arg-type]
    (UInt8MultiArray(data=[1, 256]), "UInt8MultiArray.data[1]: expected uint8, got int 256: "),
    (UInt8MultiArray(data=[-1]), "UInt8MultiArray.data[0]: expected uint8, got int -1: "),
    (
        UInt8MultiArray(data="ab"),
        "UInt8MultiArray.data: expected a sequence of uint8, got str 'ab'",
    ),  # type: ignore[arg-type]
    (UInt8MultiArray(data=7), "UInt8MultiArray.data: expected a sequence of uint8, got int 7"),  # type: ignore[arg-type]
    (UUID(b"short"), "unique_identifier_msgs/UUID.uuid: expected 16 elements, got bytes b'short'"),
    (JointState(name="arm"), "sensor_msgs/JointState.name: expected a sequence of string, got str"),  # type: ignore[arg-type]
    (JointState(name=["a", 5]), "sensor_msgs/JointState.name[1]: expected string, got int 5"),  # type: ignore[list-item]
    (JointState(name=["a\0"]), "sensor_msgs/JointState.name[0]: expected string, got str 'a\\x00'"),
    (
        ParameterDescriptor(floating_point_range=[FloatingPointRange()] * 2),
        "floating_point_range: expected at most 1 elements, got list [",
    ),
    (WIDE("\ud800", "", []), "written/It.a: expected wstring, got str '\\ud800': "),
    (WIDE("", "abc", []), "written/It.b: expected at most 2 code units, got str 'abc'"),
    (WIDE("", "", ["a", 1]), "written/It.c[1]: expected wstring, got int 1"),
    (BOUNDED("abcd", [], b"", [], []), "written/It.a: expected at most 3 bytes of UTF-8, got str"),
    (
        BOUNDED("é€", [], b"", [], []),
        "written/It.a: expected at most 3 bytes of UTF-8, got str 'é€'",
    ),
    (BOUNDED("", ["abcd"], b"", [], []), "written/It.b[0]: expected at most 3 bytes of UTF-8"),
    (BOUNDED("", ["a"] * 3, b"", [], []), "written/It.b: expected at most 2 elements, got list"),
    (
        BOUNDED("", [], b"abc", [], []),
        "written/It.c: expected at most 2 elements, got bytes b'abc'",
    ),
    (BOUNDED("", [], b"", [1.0] * 3, []), "written/It.d: expected at most 2 elements, got list"),
    (
        BOUNDED("", [], b"", [], [1, 2]),
        "written/It.e: expected at most 1 elements, got list [1, 2]",
    ),
]


@pytest.mark.parametrize(("message", "expected"), BAD)
def test_wrong_values(message: Message, expected: str) -> None:
    with pytest.raises(EncodeError) as caught:
        message.to_cdr()
    assert expected in str(caught.value)
    assert caught.value.type_name == message._type
    assert caught.value.__suppress_context__


def test_long_values_are_cut_short() -> None:
    with pytest.raises(EncodeError) as caught:
        Float64("x" * 1000).to_cdr()  # type: ignore[arg-type]
    assert len(str(caught.value)) < 130


def with_member(message: Message, name: str, value: Any) -> Message:
    setattr(message, name, value)
    return message


GOOD: list[tuple[Message, Message]] = [
    (Float64(1), Float64(1.0)),
    (Float64(True), Float64(1.0)),
    (Float64(np.float32(0.5)), Float64(0.5)),  # type: ignore[arg-type]
    (Float32(math.inf), Float32(math.inf)),
    (Int32(np.int64(5)), Int32(5)),  # type: ignore[arg-type]
    (Int32(True), Int32(1)),
    (Bool(np.bool_(True)), Bool(True)),  # type: ignore[arg-type]
    (Bool(1), Bool(True)),  # type: ignore[arg-type]
    (Byte(-1), Byte(255)),
    (Byte(b"\7"), Byte(7)),  # type: ignore[arg-type]
    (Char(b"a"), Char(97)),  # type: ignore[arg-type]
    (String(b"abc"), String("abc")),  # type: ignore[arg-type]
    (String(np.str_("abc")), String("abc")),
    (Int32MultiArray(data=(1, 2)), Int32MultiArray(data=array("i", [1, 2]))),  # type: ignore[arg-type]
    (Int32MultiArray(data=np.array([1, 2])), Int32MultiArray(data=array("i", [1, 2]))),
    (Int32MultiArray(data=range(3)), Int32MultiArray(data=array("i", [0, 1, 2]))),  # type: ignore[arg-type]
    (Int32MultiArray(data=array("q", [1])), Int32MultiArray(data=array("i", [1]))),
    (LaserScan(ranges=np.array([0.5, 1.5])), LaserScan(ranges=array("f", [0.5, 1.5]))),
    (LaserScan(ranges=np.array([math.inf])), LaserScan(ranges=array("f", [math.inf]))),
    (LaserScan(ranges=[math.inf, math.nan]), LaserScan(ranges=array("f", [math.inf, math.nan]))),
    (LaserScan(ranges=np.arange(6.0)[::2]), LaserScan(ranges=array("f", [0.0, 2.0, 4.0]))),
    (UInt8MultiArray(data=[1, 2]), UInt8MultiArray(data=b"\1\2")),
    (UInt8MultiArray(data=array("B", b"ab")), UInt8MultiArray(data=b"ab")),
    (UInt8MultiArray(data=memoryview(b"ab")), UInt8MultiArray(data=b"ab")),
    (UInt8MultiArray(data=np.array([[1], [2]], np.uint8)), UInt8MultiArray(data=b"\1\2")),
    (UInt8MultiArray(data=np.array([1, 2])), UInt8MultiArray(data=b"\1\2")),
    (ParameterValue(byte_array_value=[-1, 5]), ParameterValue(byte_array_value=b"\xff\5")),
    (ParameterValue(bool_array_value=(1, 0)), ParameterValue(bool_array_value=[True, False])),  # type: ignore[arg-type]
    (
        PoseWithCovariance(covariance=np.eye(6)),
        PoseWithCovariance(covariance=array("d", np.eye(6).ravel().tolist())),
    ),
    (JointState(name=("a", "b")), JointState(name=["a", "b"])),  # type: ignore[arg-type]
    (JointState(name=np.array(["a", "b"])), JointState(name=["a", "b"])),  # type: ignore[arg-type]
    (PoseArray(poses=(Pose(),)), PoseArray(poses=[Pose()])),  # type: ignore[arg-type]
    (UUID([*range(16)]), UUID(bytes(range(16)))),
    (Image(data=bytearray(b"ab")), Image(data=b"ab")),
    (ColorRGBA(1, 0, 0, 1), ColorRGBA(1.0, 0.0, 0.0, 1.0)),
]


@pytest.mark.parametrize(("given", "meant"), GOOD)
def test_acceptable_values(given: Message, meant: Message) -> None:
    assert given.to_cdr() == meant.to_cdr()


def test_a_message_of_another_type_with_the_same_fields_will_do() -> None:
    assert Twist(linear=Point(1.0, 2.0, 3.0)).to_cdr() == Twist(Vector3(1.0, 2.0, 3.0)).to_cdr()  # type: ignore[arg-type]


def test_errors_of_the_values_themselves_are_not_hidden() -> None:
    class Broken:
        @property
        def x(self) -> float:
            raise RuntimeError("out of order")

    with pytest.raises(RuntimeError, match="out of order"):
        Twist(linear=Broken()).to_cdr()  # type: ignore[arg-type]
