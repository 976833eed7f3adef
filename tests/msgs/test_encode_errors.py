"""What is acceptable as a value of a field, and what is said of the rest."""

from __future__ import annotations

import math
import timeit
from array import array
from collections.abc import Callable
from struct import Struct
from typing import Any

import numpy as np
import pytest

import rosz.msgs.builtin_interfaces.msg
import rosz.msgs.geometry_msgs.msg
import rosz.msgs.rcl_interfaces.msg
import rosz.msgs.sensor_msgs.msg
import rosz.msgs.std_msgs.msg
import rosz.msgs.unique_identifier_msgs.msg
from rosz.errors import EncodeError
from rosz.message import Message

from .invented import Written

# Untyped, for there is much in here that a type checker refuses.
builtin: Any = rosz.msgs.builtin_interfaces.msg
geometry: Any = rosz.msgs.geometry_msgs.msg
rcl: Any = rosz.msgs.rcl_interfaces.msg
sensor: Any = rosz.msgs.sensor_msgs.msg
std: Any = rosz.msgs.std_msgs.msg
unique: Any = rosz.msgs.unique_identifier_msgs.msg

WIDE = Written("wstring a\nwstring<=2 b\nwstring[] c")
BOUNDED = Written(
    "string<=3 a\nstring<=3[<=2] b\nuint8[<=2] c\nfloat64[<=2] d\nP[<=1] e", P="bool x"
)


FLAGS = Written("bool[] a\nbool[2] b\nP[] c", P="bool x\nuint8 y")
FLAG_PAIR: Any = FLAGS.below("P")


class Odd:
    def __repr__(self) -> str:
        return "<odd>"


odd: Any = Odd()
big_endian: Any = np.arange(3, dtype=">i4")

BAD: list[tuple[Message, str]] = [
    (
        std.Float64MultiArray(data=iter([1.0])),
        "std_msgs/Float64MultiArray.data: expected a sequence of float64, got list_iterator",
    ),
    (
        std.UInt8MultiArray(data=map(int, "12")),
        "std_msgs/UInt8MultiArray.data: expected a sequence of uint8, got map",
    ),
    (
        rcl.ParameterValue(bool_array_value=filter(None, [True])),
        "bool_array_value: expected a sequence of bool, got filter",
    ),
    (
        std.Int32MultiArray(data=np.array(5)),
        "std_msgs/Int32MultiArray.data: expected a sequence of int32, got ndarray array(5)",
    ),
    (
        std.UInt8MultiArray(data=np.array(5)),
        "std_msgs/UInt8MultiArray.data: expected a sequence of uint8, got ndarray array(5)",
    ),
    (
        std.UInt8MultiArray(data=np.array(["a"])),
        "std_msgs/UInt8MultiArray.data[0]: expected uint8, got str",
    ),
    (
        std.UInt8MultiArray(data=memoryview(big_endian)),
        "std_msgs/UInt8MultiArray.data: expected a sequence of uint8, got memoryview",
    ),
    (std.Float64(odd), "std_msgs/Float64.data: expected float64, got Odd <odd>"),
    (std.Float64("1"), "std_msgs/Float64.data: expected float64, got str '1'"),
    (std.Float64(None), "std_msgs/Float64.data: expected float64, got NoneType None"),
    (
        std.Float32(1e39),
        "std_msgs/Float32.data: expected float32, got float 1e+39: it is outside",
    ),
    (std.Int32(1.5), "std_msgs/Int32.data: expected int32, got float 1.5"),
    (
        std.Int32(1 << 31),
        "std_msgs/Int32.data: expected int32, got int 2147483648: the range of the",
    ),
    (
        std.Int8(-129),
        "std_msgs/Int8.data: expected int8, got int -129: the range of the type is -128",
    ),
    (std.UInt64(-1), "std_msgs/UInt64.data: expected uint64, got int -1: "),
    (std.Char(256), "std_msgs/Char.data: expected char, got int 256: "),
    (std.Byte(-129), "std_msgs/Byte.data: expected byte, got int -129: "),
    (std.Byte(b"ab"), "std_msgs/Byte.data: expected byte, got bytes b'ab'"),
    (std.Bool("yes"), "std_msgs/Bool.data: expected bool, got str 'yes'"),
    (std.Bool(None), "std_msgs/Bool.data: expected bool, got NoneType None"),
    (std.Bool(0.5), "std_msgs/Bool.data: expected bool, got float 0.5"),
    (std.Bool([]), "std_msgs/Bool.data: expected bool, got list []"),
    (sensor.Image(is_bigendian=None), "sensor_msgs/Image.is_bigendian: expected uint8, got NoneT"),
    (FLAGS(["no"], [], []), "written/It.a[0]: expected bool, got str 'no'"),
    (FLAGS([], [False, None], []), "written/It.b[1]: expected bool, got NoneType None"),
    (FLAGS([], [False] * 3, []), "written/It.b: expected 2 elements, got list [False, False, Fal"),
    (
        FLAGS([], [False] * 2, [FLAG_PAIR(True, 1), FLAG_PAIR("no", 2)]),
        "written/It.c[1].x: expected bool, got str 'no'",
    ),
    (std.String(5), "std_msgs/String.data: expected string, got int 5"),
    (
        std.String("a\0b"),
        "std_msgs/String.data: expected string, got str 'a\\x00b': "
        "the character at index 1 is NUL, which ends a string on the wire; send bytes in a field",
    ),
    (
        std.String("\ud800"),
        "std_msgs/String.data: expected string, got str '\\ud800': 'utf-8' codec",
    ),
    (std.String(b"\xff"), "std_msgs/String.data: expected string, got bytes b'\\xff': 'utf-8'"),
    (
        geometry.Twist(linear=odd),
        "Twist.linear: expected geometry_msgs/Vector3, got Odd <odd>: it has no",
    ),
    (
        geometry.Twist(geometry.Vector3(y=odd)),
        "geometry_msgs/Twist.linear.y: expected float64, got Odd <odd>",
    ),
    (
        geometry.PoseStamped(std.Header(frame_id=odd)),
        "geometry_msgs/PoseStamped.header.frame_id: expected string, got Odd <odd>",
    ),
    (
        geometry.PoseStamped(std.Header(0, builtin.Time(-1, 1 << 32))),
        "geometry_msgs/PoseStamped.header.stamp.nanosec: expected uint32, got int 4294967296",
    ),
    (
        geometry.PoseArray(poses=[geometry.Pose(), geometry.Pose(geometry.Point(z=odd))]),
        "geometry_msgs/PoseArray.poses[1].position.z: expected float64, got Odd <odd>",
    ),
    (
        geometry.PoseArray(poses=odd),
        "geometry_msgs/PoseArray.poses: expected a sequence of geometry_msgs/Pose",
    ),
    (
        geometry.PoseArray(poses=[1]),
        "poses[0]: expected geometry_msgs/Pose, got int 1: it has no field",
    ),
    (
        geometry.PoseWithCovariance(covariance=[0.0] * 35),
        "geometry_msgs/PoseWithCovariance.covariance: expected 36 elements, got list [0.0,",
    ),
    (
        geometry.PoseWithCovariance(covariance=[*[0.0] * 35, odd]),
        "PoseWithCovariance.covariance[35]: expected float64, got Odd <odd>",
    ),
    (
        sensor.LaserScan(ranges=[1.0, "a"]),
        "sensor_msgs/LaserScan.ranges[1]: expected float32, got str 'a'",
    ),
    (
        sensor.LaserScan(ranges=[1.0, 1e39]),
        "LaserScan.ranges[1]: expected float32, got float 1e+39: ",
    ),
    (
        sensor.LaserScan(ranges=np.array([1e39])),
        "LaserScan.ranges[0]: expected float32, got float64 ",
    ),
    (
        sensor.LaserScan(ranges="abc"),
        "LaserScan.ranges: expected a sequence of float32, got str 'abc'",
    ),
    (sensor.LaserScan(ranges=5), "LaserScan.ranges: expected a sequence of float32, got int 5"),
    (sensor.LaserScan(ranges={}), "LaserScan.ranges: expected a sequence of float32, got dict {}"),
    (std.Int32MultiArray(data=[1, 2.5]), "Int32MultiArray.data[1]: expected int32, got float 2.5"),
    (
        std.Int32MultiArray(data=np.array([1.5])),
        "Int32MultiArray.data[0]: expected int32, got float64",
    ),
    (
        std.Int32MultiArray(data=[1 << 40]),
        "Int32MultiArray.data[0]: expected int32, got int 1099511627776",
    ),
    (
        std.Int8MultiArray(data=np.array([200], np.uint8)),
        "Int8MultiArray.data[0]: expected int8, got",
    ),
    (
        std.Int8MultiArray(data=b"ab"),
        "Int8MultiArray.data: expected a sequence of int8, got bytes b'ab'",
    ),
    (std.UInt8MultiArray(data=[1, 256]), "UInt8MultiArray.data[1]: expected uint8, got int 256: "),
    (std.UInt8MultiArray(data=[-1]), "UInt8MultiArray.data[0]: expected uint8, got int -1: "),
    (
        std.UInt8MultiArray(data="ab"),
        "UInt8MultiArray.data: expected a sequence of uint8, got str 'ab'",
    ),
    (std.UInt8MultiArray(data=7), "UInt8MultiArray.data: expected a sequence of uint8, got int 7"),
    (
        unique.UUID(b"short"),
        "unique_identifier_msgs/UUID.uuid: expected 16 elements, got bytes b'short'",
    ),
    (
        sensor.JointState(name="arm"),
        "sensor_msgs/JointState.name: expected a sequence of string, got str",
    ),
    (
        sensor.JointState(name=["a", 5]),
        "sensor_msgs/JointState.name[1]: expected string, got int 5",
    ),
    (
        sensor.JointState(name=["a\0"]),
        "sensor_msgs/JointState.name[0]: expected string, got str 'a\\x00'",
    ),
    (
        rcl.ParameterDescriptor(floating_point_range=[rcl.FloatingPointRange()] * 2),
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
        std.Float64("x" * 1000).to_cdr()
    assert len(str(caught.value)) < 130


def with_member(message: Message, name: str, value: Any) -> Message:
    setattr(message, name, value)
    return message


GOOD: list[tuple[Message, Message]] = [
    (std.UInt8MultiArray(data=big_endian), std.UInt8MultiArray(data=b"\0\1\2")),
    (std.Float64(1), std.Float64(1.0)),
    (std.Float64(True), std.Float64(1.0)),
    (std.Float64(np.float32(0.5)), std.Float64(0.5)),
    (std.Float32(math.inf), std.Float32(math.inf)),
    (std.Int32(np.int64(5)), std.Int32(5)),
    (std.Int32(True), std.Int32(1)),
    (std.Bool(np.bool_(True)), std.Bool(True)),
    (std.Bool(1), std.Bool(True)),
    (std.Bool(300), std.Bool(True)),
    (
        FLAGS((1, 0, 300), [np.bool_(True), False], [FLAG_PAIR(np.bool_(True), 1)]),
        FLAGS([True, False, True], [True, False], [FLAG_PAIR(True, 1)]),
    ),
    (
        FLAGS(np.array([1, 0]), np.array([[True], [False]]), []),
        FLAGS([True, False], [True, False], []),
    ),
    (std.Byte(-1), std.Byte(255)),
    (std.Byte(b"\7"), std.Byte(7)),
    (std.Char(b"a"), std.Char(97)),
    (std.String(b"abc"), std.String("abc")),
    (std.String(np.str_("abc")), std.String("abc")),
    (std.Int32MultiArray(data=(1, 2)), std.Int32MultiArray(data=array("i", [1, 2]))),
    (std.Int32MultiArray(data=np.array([1, 2])), std.Int32MultiArray(data=array("i", [1, 2]))),
    (std.Int32MultiArray(data=range(3)), std.Int32MultiArray(data=array("i", [0, 1, 2]))),
    (std.Int32MultiArray(data=array("q", [1])), std.Int32MultiArray(data=array("i", [1]))),
    (
        sensor.LaserScan(ranges=np.array([0.5, 1.5])),
        sensor.LaserScan(ranges=array("f", [0.5, 1.5])),
    ),
    (
        sensor.LaserScan(ranges=np.array([math.inf])),
        sensor.LaserScan(ranges=array("f", [math.inf])),
    ),
    (
        sensor.LaserScan(ranges=[math.inf, math.nan]),
        sensor.LaserScan(ranges=array("f", [math.inf, math.nan])),
    ),
    (
        sensor.LaserScan(ranges=np.arange(6.0)[::2]),
        sensor.LaserScan(ranges=array("f", [0.0, 2.0, 4.0])),
    ),
    (std.UInt8MultiArray(data=[1, 2]), std.UInt8MultiArray(data=b"\1\2")),
    (std.UInt8MultiArray(data=array("B", b"ab")), std.UInt8MultiArray(data=b"ab")),
    (std.UInt8MultiArray(data=memoryview(b"ab")), std.UInt8MultiArray(data=b"ab")),
    (std.UInt8MultiArray(data=np.array([[1], [2]], np.uint8)), std.UInt8MultiArray(data=b"\1\2")),
    (std.UInt8MultiArray(data=np.array([1, 2])), std.UInt8MultiArray(data=b"\1\2")),
    (rcl.ParameterValue(byte_array_value=[-1, 5]), rcl.ParameterValue(byte_array_value=b"\xff\5")),
    (
        rcl.ParameterValue(bool_array_value=(1, 0)),
        rcl.ParameterValue(bool_array_value=[True, False]),
    ),
    (
        geometry.PoseWithCovariance(covariance=np.eye(6)),
        geometry.PoseWithCovariance(covariance=array("d", np.eye(6).ravel().tolist())),
    ),
    (sensor.JointState(name=("a", "b")), sensor.JointState(name=["a", "b"])),
    (sensor.JointState(name=np.array(["a", "b"])), sensor.JointState(name=["a", "b"])),
    (geometry.PoseArray(poses=(geometry.Pose(),)), geometry.PoseArray(poses=[geometry.Pose()])),
    (unique.UUID([*range(16)]), unique.UUID(bytes(range(16)))),
    (sensor.Image(data=bytearray(b"ab")), sensor.Image(data=b"ab")),
    (std.ColorRGBA(1, 0, 0, 1), std.ColorRGBA(1.0, 0.0, 0.0, 1.0)),
]


@pytest.mark.parametrize(("given", "meant"), GOOD)
def test_acceptable_values(given: Message, meant: Message) -> None:
    assert given.to_cdr() == meant.to_cdr()


def test_lists_of_numbers_are_packed_at_once() -> None:
    """A list of numbers costs what ``struct`` takes for it, with infinite ranges among them too."""
    ranges = [math.inf if i % 7 == 0 else 0.1 * i for i in range(720)]
    scan = sensor.LaserScan(ranges=ranges)
    pack = Struct(f"<{len(ranges)}f").pack

    def best(work: Callable[[], object]) -> float:
        return min(timeit.repeat(work, number=20, repeat=50))

    assert best(scan.to_cdr) < 4 * best(lambda: pack(*ranges))


def test_a_message_of_another_type_with_the_same_fields_will_do() -> None:
    assert (
        geometry.Twist(linear=geometry.Point(1.0, 2.0, 3.0)).to_cdr()
        == geometry.Twist(geometry.Vector3(1.0, 2.0, 3.0)).to_cdr()
    )


def test_errors_of_the_values_themselves_are_not_hidden() -> None:
    class Broken:
        @property
        def x(self) -> float:
            raise RuntimeError("out of order")

    with pytest.raises(RuntimeError, match="out of order"):
        geometry.Twist(linear=Broken()).to_cdr()
