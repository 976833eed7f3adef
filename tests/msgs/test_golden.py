"""Bytes that are right by other authorities: rosbags, and an independent encoder."""

from __future__ import annotations

from array import array

import pytest

from rosz.message import Message
from rosz.message.schema_codec import encode_plainly
from rosz.msgs.action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.example_interfaces.srv import AddTwoInts
from rosz.msgs.geometry_msgs.msg import Twist, Vector3
from rosz.msgs.rcl_interfaces.msg import (
    ListParametersResult,
    Log,
    Parameter,
    ParameterValue,
    SetParametersResult,
)
from rosz.msgs.rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rosz.msgs.sensor_msgs.msg import Image
from rosz.msgs.std_msgs.msg import Empty, Header, String
from rosz.msgs.unique_identifier_msgs.msg import UUID

from .invented import Written

# uint8 at 0, double at 8, a string of 2 + NUL, …: one of nearly everything.
MIXED = Written(
    "uint8 a\nfloat64 b\nstring c\nfloat64[] d\nfloat64[] e\n"
    "bool[3] f\nint16 g\nstring[2] h\nuint64 i\n"
)
WIDE = Written("wstring text")
GOAL = Written("UUID goal_id\nint32 order", UUID="uint8[16] uuid")
RESULT = Written("int8 status\nint32[] sequence")

VECTORS: list[tuple[str, Message, str]] = [
    ("string", String("hello"), "000100000600000068656c6c6f00"),
    ("empty string", String(""), "000100000100000000"),
    ("two and three bytes per character", String("é€"), "0001000006000000c3a9e282ac00"),
    ("nothing", Empty(), "0001000000"),
    ("header", Header(0, Time(1, 2), "map"), "000100000100000002000000040000006d617000"),
    (
        "twist",
        Twist(Vector3(1.0, 2.0, 3.0), Vector3(0.0, 0.0, 0.5)),
        "00010000000000000000f03f000000000000004000000000000008400000000000000000"
        "0000000000000000000000000000e03f",
    ),
    (
        "image",
        Image(Header(0, Time(1, 2), "c"), 2, 1, "rgb8", 0, 3, bytes([1, 2, 3, 4, 5, 6])),
        "000100000100000002000000020000006300000002000000010000000500000072676238"
        "000000000300000006000000010203040506",
    ),
    ("request", AddTwoInts.Request(2, 3), "0001000002000000000000000300000000000000"),
    ("response", AddTwoInts.Response(5), "000100000500000000000000"),
    (
        "integer parameter",
        ParameterValue(type=2, integer_value=42),
        "0001000002000000000000002a0000000000000000000000000000000100000000000000"
        "0000000000000000000000000000000000000000",
    ),
    (
        "parameter with all lists",
        ParameterValue(
            type=7,
            string_value="ab",
            bool_array_value=[True, False, True],
            integer_array_value=array("q", [1, -1]),
            double_array_value=array("d", [0.5]),
            string_array_value=["x", "yz"],
        ),
        "000100000700000000000000000000000000000000000000000000000300000061620000"
        "000000000300000001000100020000000100000000000000ffffffffffffffff01000000"
        "00000000000000000000e03f02000000020000007800000003000000797a00",
    ),
    (
        "log",
        Log(Time(1, 2), 20, "n", "hi", "f.c", "fn", 7),
        "00010000010000000200000014000000020000006e000000030000006869000004000000"
        "662e630003000000666e000007000000",
    ),
    (
        "goals",
        GoalStatusArray(
            [
                GoalStatus(GoalInfo(UUID(b"\1" * 16), Time(1)), 2),
                GoalStatus(GoalInfo(UUID(b"\2" * 16), Time(2)), 3),
            ]
        ),
        "000100000200000001010101010101010101010101010101010000000000000002020202"
        "02020202020202020202020202000000020000000000000003",
    ),
    (
        "of everything",
        MIXED(1, 1.5, "ab", [], [2.5], [True, False, True], -2, ["", "z"], 9),
        "000100000100000000000000000000000000f83f03000000616200000000000001000000"
        "000000000000044001000100feff00000100000000000000020000007a00000009000000"
        "00000000",
    ),
    ("wide string", WIDE("hi€"), "00010000030000006800000069000000ac200000"),
    ("list parameters", ListParameters.Request([], 0), "0001000000000000000000000000000000000000"),
    (
        "get parameters",
        GetParameters.Request(["use_sim_time"]),
        "00010000010000000d0000007573655f73696d5f74696d6500",
    ),
    (
        "listed parameters",
        ListParameters.Response(ListParametersResult(["a", "b.c"], ["b"])),
        "0001000002000000020000006100000004000000622e630001000000020000006200",
    ),
    (
        "set parameters",
        SetParameters.Request([Parameter("k", ParameterValue(type=3, double_value=0.25))]),
        "0001000001000000020000006b000300000000000000000000000000000000000000d03f"
        "01000000000000000000000000000000000000000000000000000000",
    ),
    (
        "parameters set",
        SetParameters.Response([SetParametersResult(successful=True)]),
        "0001000001000000010000000100000000",
    ),
    (
        "send goal",
        GOAL(GOAL.below("UUID")(bytes(range(16))), 5),
        "00010000000102030405060708090a0b0c0d0e0f05000000",
    ),
    ("get result", RESULT(4, [0, 1, 1]), "000100000400000003000000000000000100000001000000"),
]


@pytest.mark.parametrize(("message", "expected"), [pytest.param(m, e, id=n) for n, m, e in VECTORS])
def test_bytes(message: Message, expected: str) -> None:
    data = bytes.fromhex(expected)
    assert message.to_cdr() == data
    assert encode_plainly(message, type(message)) == data
    assert type(message).from_cdr(data).to_cdr() == data


def test_a_string_of_length_zero_is_empty() -> None:
    """Some writers leave the NUL out of an empty string."""
    assert String.from_cdr(bytes.fromhex("0001000000000000")) == String("")
    header = Header.from_cdr(bytes.fromhex("00010000010000000200000000000000"))
    assert header == Header(0, Time(1, 2), "")
