"""The text of messages, and filling messages from text, against genpy."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import Worker, require

from rosz.errors import EncodeError
from rosz.message import Message
from rosz.message.convert import fill_message_args
from rosz.message.text import strify_message
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import PoseStamped, Twist
from rosz.msgs.std_msgs.msg import Char, Header, String, UInt8MultiArray
from rosz.typestore import TypeStore

from . import values

STORE = TypeStore()
TYPES = [
    *("geometry_msgs/Point", "geometry_msgs/PolygonStamped", "geometry_msgs/PoseArray"),
    *("geometry_msgs/TransformStamped", "geometry_msgs/TwistWithCovarianceStamped"),
    *("std_msgs/Empty", "std_msgs/String", "std_msgs/Bool", "std_msgs/Float32", "std_msgs/Time"),
    *("std_msgs/Duration", "std_msgs/ByteMultiArray", "std_msgs/UInt8MultiArray"),
    *("std_msgs/Int64MultiArray", "std_msgs/ColorRGBA", "std_msgs/Header"),
    *("nav_msgs/Odometry", "nav_msgs/OccupancyGrid", "nav_msgs/Path", "nav_msgs/GridCells"),
    *("sensor_msgs/JointState", "sensor_msgs/LaserScan", "sensor_msgs/Image", "sensor_msgs/Imu"),
    *("sensor_msgs/PointCloud2", "sensor_msgs/MultiDOFJointState", "sensor_msgs/Joy"),
    *("diagnostic_msgs/DiagnosticArray", "actionlib_msgs/GoalStatusArray"),
]


@pytest.fixture(scope="module")
def genpy() -> Iterator[Worker]:
    require("genpy", "std_msgs.msg", package="python3-genpy, python3-std-msgs")
    worker = Worker("genpy_calls")
    yield worker
    worker.close()


def as_genpy(cls: type[Message], plain: dict[str, Any]) -> dict[str, Any]:
    """Spell a plain value as ROS 1 does."""
    stamp = {"sec": "secs", "nanosec": "nsecs"} if cls._type.startswith("builtin") else {}
    schema = {name: kind for name, kind, _ in cls._schema}
    result: dict[str, Any] = {}
    for name, value in plain.items():
        kind = schema[name]
        spelled = value
        if isinstance(kind, type):
            many = isinstance(value, list)
            spelled = [as_genpy(kind, one) for one in value] if many else as_genpy(kind, value)
        elif isinstance(value, bytes):
            spelled = list(value)
        result[stamp.get(name, name)] = spelled
    return result


@pytest.mark.parametrize("name", TYPES)
@pytest.mark.parametrize("width", [None, 7])
def test_strify_as_genpy(genpy: Worker, name: str, width: int | None) -> None:
    rng = random.Random(name)
    cls = STORE.message(name)
    spec = STORE._catalog.message(cls._type_name)
    for _ in range(8):
        plain = values.value(rng, STORE._catalog, spec)
        offset = [rng.randint(0, 9), rng.randint(0, 999_999_999)] if rng.random() < 0.2 else None
        theirs = genpy.call("text", name, [as_genpy(cls, plain)], width=width, offset=offset)
        ours = strify_message(
            values.build(cls, plain),
            time_offset=Time(*offset) if offset else None,
            fixed_numeric_width=width,
        )
        assert ours == theirs["value"]


@settings(max_examples=200)
@given(st.text(st.characters(exclude_categories=["Cs"]), max_size=120))
def test_strings_as_genpy(genpy: Worker, text: str) -> None:
    if text:
        theirs = genpy.call("text", "std_msgs/String", [text])
        assert strify_message(String(text)) == theirs["value"]
    theirs = genpy.call("text", "sensor_msgs/JointState", [{"name": [text, "b"]}])
    joints = STORE.message("sensor_msgs/JointState")()
    fill_message_args(joints, {"name": [text, "b"]})
    assert strify_message(joints) == theirs["value"]


def test_fields_can_be_left_out(genpy: Worker) -> None:
    theirs = genpy.call("text", "geometry_msgs/Twist", [{}], fields=["angular", "x"])
    assert strify_message(Twist(), field_filter=lambda _: ["angular", "x"]) == theirs["value"]


def test_bytes_held_as_text_are_numbers(genpy: Worker) -> None:
    theirs = genpy.call("text", "std_msgs/UInt8MultiArray", [{"data": "\x02\x03"}])
    message: Any = STORE.message("std_msgs/UInt8MultiArray")()
    message.data = "\x02\x03"
    assert strify_message(message) == theirs["value"]


def test_printing_a_message_shows_its_text() -> None:
    assert str(Twist()).startswith("linear: \n  x: 0.0\n")
    assert f"{String('é')}" == 'data: "\\xE9"'
    assert str(UInt8MultiArray(data=b"\1\2")).endswith("data: [1, 2]")
    assert str(Char(7)) == "data: 7"
    assert str(Header(seq=4)).startswith("seq: 4\nstamp: \n  secs: 0\n  nsecs:         0\n")


FILLS: list[tuple[str, Any]] = [
    ("std_msgs/String", ["hi"]),
    ("std_msgs/String", {"data": "hi"}),
    ("std_msgs/String", [{"data": "hi"}]),
    ("std_msgs/String", {"data": None}),
    ("std_msgs/Empty", None),
    ("std_msgs/Empty", []),
    ("std_msgs/Empty", {}),
    ("geometry_msgs/Twist", {"linear": {"x": 1.5}}),
    ("geometry_msgs/Twist", [[1.0, 2.0, 3.0], {"z": 4.0}]),
    ("geometry_msgs/Twist", [{"linear": [1.0, 2.0, 3.0]}]),
    ("std_msgs/Header", [7, {"secs": 1, "nsecs": 2}, "map"]),
    ("std_msgs/Header", {"seq": 7, "stamp": "now"}),
    ("std_msgs/Header", {"stamp": [3, 4]}),
    ("std_msgs/Header", {"stamp": 5_000_000_000}),
    ("std_msgs/Duration", {"data": -1_500_000_000}),
    ("geometry_msgs/PoseStamped", {"header": "auto"}),
    ("geometry_msgs/PoseStamped", ["auto", {"position": [1.0, 2.0, 3.0]}]),
    ("geometry_msgs/PolygonStamped", {"polygon": {"points": [[1.0, 2.0, 3.0], {"x": 4.0}]}}),
    ("diagnostic_msgs/DiagnosticArray", {"status": [{"values": [["a", "b"], {"key": "c"}]}]}),
    ("sensor_msgs/Image", {"data": [1, 2, 3]}),
    ("std_msgs/Float32MultiArray", {"layout": {"dim": [["x", 2, 2]]}, "data": [1.0, 2.0]}),
    ("geometry_msgs/PoseWithCovariance", {"covariance": [0.5] * 36}),
]

BAD_FILLS: list[tuple[str, Any, str]] = [
    (
        "std_msgs/String",
        ["a", "b"],
        "expected 1 value for the fields (data), got 2",
    ),
    ("geometry_msgs/Twist", [[1.0, 2.0, 3.0]], "(linear, angular), got 1"),
    ("geometry_msgs/Twist", [[1.0, 2.0], [0.0, 0.0, 0.0]], "Twist.linear: expected 3 values"),
    ("geometry_msgs/Twist", {"lineer": {}}, "has no field 'lineer'; did you mean 'linear'?"),
    (
        "geometry_msgs/Twist",
        {"linear": {"w": 1.0}},
        "Twist.linear: geometry_msgs/Vector3 has no field",
    ),
    ("geometry_msgs/Twist", {"linear": "fast"}, "linear: expected geometry_msgs/Vector3 or one of"),
    ("geometry_msgs/Twist", {"linear": 5}, "expected geometry_msgs/Vector3 as a dict or a list"),
    (
        "std_msgs/Header",
        {"stamp": "later"},
        "Header.stamp: expected builtin_interfaces/Time or one of",
    ),
    ("sensor_msgs/JointState", {"position": 5}, "position: expected a list of float64, got int 5"),
    ("geometry_msgs/PoseWithCovariance", {"covariance": [1.0]}, "covariance: expected 36 elements"),
    ("geometry_msgs/PoseArray", {"poses": [5]}, "poses[0]: expected geometry_msgs/Pose as a dict"),
]

NOW = (12, 345)


def listed(args: Any) -> Any:
    """Wrap a dict as genpy, which takes nothing but lists, wants it."""
    return [args] if isinstance(args, dict) else args


def filled(name: str, args: Any) -> Message:
    message = STORE.message(name)()
    now = Time(*NOW)
    fill_message_args(message, args, {"now": now, "auto": Header(0, now)})
    return message


@pytest.mark.parametrize(("name", "args"), FILLS)
def test_fill_as_genpy(genpy: Worker, name: str, args: Any) -> None:
    theirs = genpy.call("text", name, listed(args), now=NOW)["value"]
    if name in ("geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovariance"):
        theirs = theirs.replace("w: 0.0", "w: 1.0")  # ROS 2's default of a quaternion
    assert str(filled(name, args)) == theirs


@pytest.mark.parametrize(("name", "args", "expected"), BAD_FILLS)
def test_what_genpy_refuses(genpy: Worker, name: str, args: Any, expected: str) -> None:
    assert "error" in genpy.call("text", name, listed(args), now=NOW)
    with pytest.raises(EncodeError) as caught:
        filled(name, args)
    assert expected in str(caught.value)


def test_a_filled_message_can_be_sent() -> None:
    message = PoseStamped()
    fill_message_args(message, {"header": {"frame_id": "map"}, "pose": {"position": {"x": 1}}})
    assert PoseStamped.from_cdr(message.to_cdr()) == message
