"""ROS 1's byte layout against genpy and rosbags, over every shipped type that they know."""

from __future__ import annotations

import random
import re
from array import array
from typing import Any, cast

import oracle
import pytest

from rosz.errors import DecodeError, EncodeError
from rosz.message import Message, slots
from rosz.message.layout import ROS1
from rosz.message.schema_codec import decode_plainly, encode_plainly
from rosz.msgs.builtin_interfaces.msg import Duration, Time
from rosz.msgs.geometry_msgs.msg import PoseStamped
from rosz.msgs.sensor_msgs.msg import CameraInfo, Image, JointState, Range
from rosz.msgs.shape_msgs.msg import SolidPrimitive
from rosz.msgs.std_msgs.msg import Bool, Empty, Header, Int32MultiArray, String, UInt8MultiArray
from rosz.msgs.stereo_msgs.msg import DisparityImage
from rosz.msgs.visualization_msgs.msg import Marker
from rosz.typestore import TypeStore

from . import values
from .test_damage import damage

STORE = TypeStore()
CATALOG = STORE._catalog


def ros1_value(name: str, rng: random.Random) -> Message:
    """Return a random message that ROS 1 can hold."""
    cls = STORE.message(name)
    message = values.build(cls, values.value(rng, CATALOG, CATALOG.message(cls._type_name)))
    _make_ros1(message, rng)
    return message


def _make_ros1(message: Any, rng: random.Random) -> None:
    if isinstance(message, Time | Duration):
        message.sec &= 0x7FFFFFFF
        message.nanosec %= 1_000_000_000
    if isinstance(message, Header):
        message.seq = rng.getrandbits(32)
    for slot in slots(type(message)):
        member = getattr(message, slot.name)
        for one in member if isinstance(member, list) else [member]:
            if isinstance(one, Message):
                _make_ros1(one, rng)


def names() -> list[str]:
    """Return the message types that ROS 1 can have: those without wide strings."""
    return [name for name in STORE.names("msg") if "wstring" not in STORE.message(name)._text]


NAMES = names()


@pytest.mark.parametrize("name", NAMES)
def test_fast_and_slow_codec_agree(name: str) -> None:
    rng = random.Random(name)
    cls = STORE.message(name)
    for _ in range(6):
        message = ros1_value(name, rng)
        data = message.to_ros1()
        assert encode_plainly(message, cls, ROS1) == data
        again = cls.from_ros1(data)
        assert again.to_ros1() == data
        assert repr(decode_plainly(data, cls, ROS1)) == repr(again)
        assert repr(cls.from_ros1(memoryview(data + b"behind it"))) == repr(again)


@pytest.mark.ros1
def test_genpy_reads_and_writes_the_same_bytes() -> None:
    """Genpy decodes our bytes of every type and encodes them anew, to the same ones."""
    rng = random.Random(3)
    given = [[name, ros1_value(name, rng).to_ros1().hex()] for name in NAMES for _ in range(5)]
    result = oracle.real(
        """
        import io
        from genpy.message import get_message_class
        result = []
        for name, data in given:
            kind = get_message_class(name)
            if kind is None:
                continue
            buffer = io.BytesIO()
            kind().deserialize(bytes.fromhex(data)).serialize(buffer)
            result.append([name, kind._md5sum, data, buffer.getvalue().hex()])
        """,
        "geometry_msgs.msg",
        "python3-geometry-msgs",
        given=given,
    )
    assert len({name for name, *_ in result}) > 120
    for name, md5, ours, theirs in result:
        assert STORE.message(name)._md5sum == md5, name
        assert ours == theirs, name


def test_rosbags_writes_the_same_bytes() -> None:
    typesys: Any = pytest.importorskip("rosbags.typesys", reason="needs rosbags")
    theirs = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    rng = random.Random(5)
    compared = 0
    for name in NAMES:
        cls = STORE.message(name)
        if cls._type_name not in theirs.types:
            continue
        compared += 1
        data = ros1_value(name, rng).to_ros1()
        message = theirs.deserialize_ros1(data, cls._type_name)
        assert bytes(theirs.serialize_ros1(message, cls._type_name)) == data, name
    assert compared > 120


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        (Empty(), ""),
        (String("é"), "02000000 c3a9"),
        (Header(7, Time(1, 2), "map"), "07000000 01000000 02000000 03000000 6d6170"),
        (Time(2**31, 5), "00000080 05000000"),
        (Duration(-1, 5), "ffffffff 05000000"),
        (Bool(data=True), "01"),
        (UInt8MultiArray(data=b"\x01\x02"), "00000000 00000000 02000000 0102"),
        (Int32MultiArray(data=[-2]), "00000000 00000000 01000000 feffffff"),
        (Range(variance=3.0), "00" * 33),
    ],
)
def test_bytes(message: Message, expected: str) -> None:
    assert message.to_ros1() == bytes.fromhex(expected)


@pytest.mark.parametrize(
    ("cls", "absent"),
    [
        (Range, {"variance"}),
        (SolidPrimitive, {"polygon"}),
        (Marker, {"texture_resource", "texture", "uv_coordinates", "mesh_file"}),
        (CameraInfo, set()),
        (DisparityImage, set()),
    ],
)
def test_fields_that_ros_2_added_are_left_out(cls: type[Message], absent: set[str]) -> None:
    rng = random.Random(1)
    message: Any = ros1_value(cls._type, rng)
    again: Any = cls.from_ros1(message.to_ros1())
    default: Any = cls()
    for slot in slots(cls):
        expected = default if slot.name in absent else message
        ours, theirs = (getattr(one, slot.name) for one in (again, expected))
        assert str(list(ours) if isinstance(ours, array) else ours) == str(theirs)


def test_a_definition_of_ros_1_keeps_all_its_fields() -> None:
    own: Any = STORE.message_from_text("sensor_msgs/Range", "float32 range\nstring note\n")
    assert own(1.0, "x").to_ros1() == bytes.fromhex("0000803f 01000000 78")


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (PoseStamped(header=Header(stamp=Time(-1, 0))), "header.stamp.sec: expected uint32"),
        (JointState(name=cast(Any, "arm")), "JointState.name: expected a sequence of string"),
        (JointState(position=cast(Any, ["x"])), "position[0]: expected float64"),
        (Bool(data=cast(Any, "yes")), "Bool.data: expected bool"),
        (Image(data=[1, 300]), "Image.data[1]: expected uint8"),
    ],
)
def test_a_wrong_value_is_named(message: Message, text: str) -> None:
    with pytest.raises(EncodeError, match=re.escape(text)):
        message.to_ros1()


def test_wide_strings_are_refused() -> None:
    wide: Any = STORE.message_from_text("rosz_test/WString", "wstring data\n")
    with pytest.raises(EncodeError, match="ROS 1 has, which has no wstring"):
        wide("x").to_ros1()
    with pytest.raises(DecodeError, match="no wstring"):
        wide.from_ros1(bytes(8))


def test_bytes_that_are_no_text_are_replaced() -> None:
    """As in genpy: roscpp sends any bytes in a string."""
    assert String.from_ros1(b"\x02\0\0\0\xe9a").data == "�a"


def test_damaged_bytes_give_a_value_or_the_error() -> None:
    rng = random.Random(7)
    refused = 0
    for name in NAMES:
        cls = STORE.message(name)
        data = ros1_value(name, rng).to_ros1()
        for _ in range(30):
            try:
                assert type(cls.from_ros1(damage(rng, data))) is cls
            except DecodeError as error:
                assert error.type_name == cls._type  # noqa: PT017  # both outcomes are right
                refused += 1
    assert refused > 500
