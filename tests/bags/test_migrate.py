"""Messages of a bag become messages of the types known here, or are refused by field."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest

from rosz.bags import Channel
from rosz.bags.edit.migrate import MigrationError, find_conversion, find_migration
from rosz.message import Message
from rosz.msgs.geometry_msgs.msg import Point, Twist
from rosz.msgs.sensor_msgs.msg import CameraInfo
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.visualization_msgs.msg import Marker
from rosz.typestore import TypeStore

TYPES = TypeStore()


def _class(text: str) -> type[Message]:
    return TYPES.message_from_text("made_msgs/Made", text)


def _channel(cls: type[Message], **more: Any) -> Channel:
    given = {"type_hash": cls._type_hash, "md5": cls._md5sum, "definition": cls._full_text}
    return Channel("/x", cls._type_name, **{**given, **more})


def test_cdr_of_a_type_known_here_stays_as_it_is() -> None:
    found = find_conversion(_channel(Twist), TYPES)
    assert (found.message_type, found.convert, found.added) == (Twist, None, ())


@pytest.mark.parametrize(
    "message",
    [
        Twist(),
        String(data="é"),
        Point(x=1.5),
        Marker(ns="a", id=4, points=[Point(x=2.0)]),
        CameraInfo(d=[0.5], k=[1.0] * 9),
    ],
)
def test_ros1_bytes_become_cdr(message: Message) -> None:
    channel = _channel(type(message), encoding="ros1", type_hash="", definition="")
    found = find_conversion(channel, TYPES)
    assert found.message_type is type(message)
    assert found.convert is not None
    assert found.convert(message.to_ros1()) == message.to_cdr()


def test_a_type_unknown_here_has_the_name_and_hash_of_the_bag() -> None:
    made = _class("int32 a\n")
    found = find_conversion(_channel(made), TYPES)
    assert (found.message_type, found.convert) == (made, None)
    bare = find_conversion(_channel(made, definition=""), TYPES)
    assert bare.message_type._type_hash == made._type_hash
    assert bare.message_type._type_name == "made_msgs/msg/Made"
    assert bare.convert is None


def test_ros1s_names_of_fields_fit() -> None:
    text = re.sub(
        r"(?m)^(float64\[\d*\]\s+)([dkrp])\b",
        lambda found: found[1] + found[2].upper(),
        CameraInfo._full_text,
    )
    found = find_conversion(_channel(CameraInfo, definition=text, type_hash="RIHS01_x"), TYPES)
    recorded = TYPES.message_from_text("sensor_msgs/CameraInfo", text)
    assert recorded is not CameraInfo
    assert found.convert is not None
    old: Any = recorded()
    old.D, old.K[4] = [0.25], 3.0
    new = CameraInfo.from_cdr(found.convert(old.to_cdr()))
    assert (list(new.d), new.k[4]) == ([0.25], 3.0)


@pytest.mark.parametrize(
    ("old", "new", "check"),
    [
        ("int16 a\n", "int64 a\n", lambda m: m.a == 7),
        ("uint8[] a\n", "uint16[] a\n", lambda m: list(m.a) == [7]),
        ("float32[2] a\nint8 b\n", "int8 b\nfloat64[2] a\n", lambda m: list(m.a) == [1.5, 2.5]),
        ("int8[3] a\n", "int8[] a\n", lambda m: len(m.a) == 3),
    ],
)
def test_fields_that_fit_are_taken(old: str, new: str, check: Callable[[Any], bool]) -> None:
    migrate, added = find_migration(_class(old), _class(new))
    values: dict[str, Any] = {
        "uint8[] a": b"\x07",
        "float32[2] a": [1.5, 2.5],
        "int8[3] a": [1] * 3,
    }
    made: Any = _class(old)(a=values.get(old.partition("\n")[0], 7))
    assert added == ()
    assert check(migrate(made))


def test_fields_that_the_bag_lacks_get_their_defaults() -> None:
    migrate, added = find_migration(_class("int32 a\n"), _class("int32 a\nint32 b 5\n"))
    assert added == ("b",)
    made: Any = migrate(_class("int32 a\n")(a=3))
    assert (made.a, made.b) == (3, 5)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("int32 a\nint32 z\n", "int32 a\n", "field 'z' is in the bag alone"),
        ("int64 a\n", "int32 a\n", "field 'a' is a int64 in the bag, a int32 here"),
        ("string a\n", "int32 a\n", "field 'a' is a string in the bag, a int32 here"),
        ("int32 a\n", "int32[] a\n", r"field 'a' is a int32 in the bag, a int32\[\] here"),
        (
            "geometry_msgs/Point a\n",
            "geometry_msgs/Vector3Stamped a\n",
            "field 'a.x' is in the bag alone",
        ),
    ],
)
def test_fields_that_do_not_fit_are_refused(old: str, new: str, reason: str) -> None:
    with pytest.raises(MigrationError, match=reason):
        find_migration(_class(old), _class(new))
