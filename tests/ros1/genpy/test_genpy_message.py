"""genpy against the real one: checks of fields, classes by name."""

from __future__ import annotations

import io
from importlib import import_module
from typing import Any

import pytest
from oracle import same

from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.sensor_msgs.msg import LaserScan
from rosz.msgs.std_msgs.msg import Header, String
from rosz.ros1 import install

install()
genpy: Any = import_module("genpy")

VALUES = "[0, 1, -1, 255, 256, 2**31, 2**64, 1.5, True, 'a', b'a', None, [], [1], ['a'], (1, 2)]"
TYPES = (
    "int8 uint8 byte char int16 uint32 int64 uint64 float32 float64 bool string time duration"
    " int32[] uint8[] string[] float64[3] std_msgs/String"
)


@pytest.mark.ros1
def test_types_are_checked_as_genpy_does() -> None:
    same(
        f"""
        from genpy.message import check_type
        def check(kind, value):
            try:
                check_type("x", kind, value)
            except Exception as error:
                return str(error)
            return "fits"
        result = {{
            f"{{kind}} {{value!r}}": check(kind, value)
            for kind in {TYPES.split()} for value in {VALUES}
        }}
        """,
        "genpy",
        "python3-genpy",
    )


def test_messages_are_checked() -> None:
    genpy.message.check_type("x", "geometry_msgs/Twist", Twist())
    genpy.message.check_type("x", "Header", Header())
    genpy.message.check_type("x", "sensor_msgs/LaserScan", LaserScan(ranges=[1.0, 2.0]))
    with pytest.raises(genpy.SerializationError, match="field x must be of type std_msgs/String"):
        genpy.message.check_type("x", "std_msgs/String", Twist())
    wrong: Any = Twist()
    wrong.linear.x = "fast"
    with pytest.raises(genpy.SerializationError, match=r"field x\.linear\.x must be float type"):
        genpy.message.check_type("x", "geometry_msgs/Twist", wrong)


def test_classes_by_name() -> None:
    assert genpy.message.get_message_class("std_msgs/String") is String
    assert genpy.message.get_message_class("Header") is Header
    service = genpy.message.get_service_class("std_srvs/SetBool")
    assert service is not None
    assert service._type == "std_srvs/SetBool"
    assert genpy.message.get_message_class("std_msgs/Nothing") is None
    assert genpy.message.get_service_class("nowhere/Nothing") is None
    with pytest.raises(ValueError, match="missing package name"):
        genpy.message.get_message_class("String")


@pytest.mark.ros1
def test_printable_arguments() -> None:
    same(
        """
        from genpy.message import get_printable_message_args
        from geometry_msgs.msg import PoseStamped, Twist
        from std_msgs.msg import Empty, String
        import io
        result = [get_printable_message_args(cls()) for cls in (PoseStamped, Twist, Empty, String)]
        result.append(get_printable_message_args(Twist(), io.StringIO(), "cmd."))
        """,
        "geometry_msgs.msg",
        "python3-geometry-msgs",
    )


def test_fill_message_args() -> None:
    twist = Twist()
    genpy.message.fill_message_args(twist, [{"linear": {"x": 1}}])
    assert twist.linear.x == 1.0
    with pytest.raises(genpy.MessageException, match="no field 'lineer'"):
        genpy.message.fill_message_args(twist, [{"lineer": 1}])


def test_serialisation_round_trips() -> None:
    buffer = io.BytesIO()
    String("hello").serialize(buffer)
    assert String().deserialize(buffer.getvalue()) == String("hello")
    with pytest.raises(genpy.DeserializationError):
        String().deserialize(b"\x00")
    wrong: Any = Twist()
    wrong.linear = 3
    with pytest.raises(genpy.SerializationError):
        wrong.serialize(io.BytesIO())
    with pytest.raises(genpy.MessageException):
        wrong.serialize(io.BytesIO())


def test_times_are_the_classes_of_fields() -> None:
    assert isinstance(Header().stamp, genpy.Time)
    assert isinstance(genpy.Time(1) - genpy.Time(), genpy.Duration)
    assert isinstance(genpy.Duration(1), genpy.TVal)
    assert isinstance(String(), genpy.Message)
