from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosz.errors import DefinitionError
from rosz.idl import Constant, Field, FieldType, parse_action, parse_message, parse_service
from rosz.idl.catalog import action_messages

from .definitions import INTERFACES
from .malformed import ACTIONS, MESSAGES, SERVICES


def fields(text: str) -> list[tuple[str, FieldType, object]]:
    spec = parse_message("pkg/msg/Good", text)
    return [(field.name, field.type, field.default) for field in spec.fields]


def constant(text: str) -> Constant:
    spec = parse_message("pkg/msg/Good", text)
    assert not spec.fields
    return spec.constants[0]


@pytest.mark.parametrize(
    ("written", "base", "bound", "shape", "size"),
    [
        ("int32", "int32", 0, "one", 0),
        ("byte", "byte", 0, "one", 0),
        ("char", "char", 0, "one", 0),
        ("string<=10", "string", 10, "one", 0),
        ("wstring<=3[]", "wstring", 3, "sequence", 0),
        ("string<=5[<=2]", "string", 5, "bounded", 2),
        ("float64[36]", "float64", 0, "fixed", 36),
        ("uint8[]", "uint8", 0, "sequence", 0),
        ("uint8[<=7]", "uint8", 0, "bounded", 7),
        ("Other", "pkg/msg/Other", 0, "one", 0),
        ("other_pkg/Other[]", "other_pkg/msg/Other", 0, "sequence", 0),
        ("other_pkg/msg/Other[2]", "other_pkg/msg/Other", 0, "fixed", 2),
        ("time", "builtin_interfaces/msg/Time", 0, "one", 0),
        ("duration[]", "builtin_interfaces/msg/Duration", 0, "sequence", 0),
        ("Header", "std_msgs/msg/Header", 0, "one", 0),
        ("std_msgs/Header", "std_msgs/msg/Header", 0, "one", 0),
        ("roslib/Header", "std_msgs/msg/Header", 0, "one", 0),
        ("bool_t", "pkg/msg/bool_t", 0, "one", 0),
    ],
)
def test_types(written: str, base: str, bound: int, shape: str, size: int) -> None:
    ((name, kind, default),) = fields(f"{written} value")
    assert (name, default) == ("value", None)
    assert (kind.base, kind.bound, kind.shape, kind.size) == (base, bound, shape, size)
    assert kind.written + kind.suffix == written


@pytest.mark.parametrize(
    ("line", "default"),
    [
        ("int32 x 5", 5),
        ("int32 x -5  # comment", -5),
        ("uint8 x 0xff", 255),
        ("uint8 x 0b101", 5),
        ("uint8 x 0o17", 15),
        ("int64 x -9223372036854775808", -(1 << 63)),
        ("bool x true", True),
        ("bool x False", False),
        ("bool x 1", True),
        ("float64 x 1", 1.0),
        ("float64 x -.5e3", -500.0),
        ("float32 x inf", float("inf")),
        ("@key float32 x 3.4028235e38", 3.4028235e38),
        ('string x "a # b"', "a # b"),
        (r"string x 'it\'s'", "it's"),
        (r'string x "\tA\u00e9\"" # c', '\tA\u00e9"'),
        ("string x plain words # c", "plain words"),
        ("int32[] x []", ()),
        ("int32[] x [1,2 , 3]", (1, 2, 3)),
        ("int32[2] x [1, 2]", (1, 2)),
        ("string[] x ['a, b', \"c]\", d]", ("a, b", "c]", "d")),
        ("bool[<=3] x [true, 0]", (True, False)),
    ],
)
def test_defaults(line: str, default: object) -> None:
    ((_, _, found),) = fields(line)
    assert found == default
    assert type(found) is type(default)


@pytest.mark.parametrize(
    ("line", "value", "text"),
    [
        ("int32 X=1", 1, "1"),
        ("int32 X = -1 # comment", -1, "-1"),
        ("uint8 X=007", 7, "007"),
        ("uint8 x=0x10", 16, "0x10"),
        ("byte OK=0", 0, "0"),
        ("byte LOW=-128", -128, "-128"),
        ("bool YES=True", True, "True"),
        ("float32 PI=3.14", 3.14, "3.14"),
        ("float64 X=1e-3", 0.001, "1e-3"),
        ("string NAME=bare words # and all", "bare words # and all", "bare words # and all"),
        ('string NAME="quoted"', "quoted", '"quoted"'),
        ('string NAME="quoted" # not this', "quoted", '"quoted" # not this'),
        ("string NAME=it's", "it's", "it's"),
        ("string APOSTROPHE='", "'", "'"),
        ("string EMPTY=", "", ""),
        ("wstring W='\u20ac'", "\u20ac", "'\u20ac'"),
    ],
)
def test_constants(line: str, value: object, text: str) -> None:
    found = constant(line)
    assert (found.value, found.text) == (value, text)
    assert type(found.value) is type(value)


def test_a_whole_message() -> None:
    text = "\ufeff# a comment\r\n\r\n  int32\tx # tabs\r\nuint8 A=1\r\n@key\r\nB[] list#tight\r\n"
    spec = parse_message("pkg/msg/Good", text, "Good.msg")
    assert spec.fields == (
        Field("x", FieldType("int32", written="int32"), None, 3, 3),
        Field("list", FieldType("pkg/msg/B", shape="sequence", written="B"), None, 6, 1),
    )
    assert spec.constants == (Constant("A", "uint8", 1, "1"),)
    assert (spec.text, spec.path) == (text, "Good.msg")


def test_empty_message() -> None:
    assert parse_message("pkg/msg/Good", "").fields == ()
    assert parse_message("pkg/msg/Good", "\n# nothing\n").fields == ()


def test_messages_of_an_action_of_ros1() -> None:
    """Separators only begin with dashes, as in ROS 1."""
    parts = action_messages("Go", "int32 a\n----- result\nint32 b\n---#\nint32 c")
    assert [parts[name] for name in ("GoGoal", "GoResult", "GoFeedback")] == [
        "int32 a\n",
        "int32 b\n",
        "int32 c",
    ]


def test_service_and_action_parts() -> None:
    service = parse_service("pkg/srv/Do", "int32 a\n--- # the answer\nint32 b")
    assert (service.request.name, service.response.name) == (
        "pkg/srv/Do_Request",
        "pkg/srv/Do_Response",
    )
    assert [field.name for field in service.response.fields] == ["b"]
    assert service.response.fields[0].line == 3
    action = parse_action("pkg/action/Go", "---\nint32 b\n---\nint32 c")
    parts = (action.goal, action.result, action.feedback)
    assert [part.name.rpartition("_")[2] for part in parts] == ["Goal", "Result", "Feedback"]
    assert [len(part.fields) for part in parts] == [0, 1, 1]


@pytest.mark.parametrize(("text", "expected"), MESSAGES)
def test_malformed_messages(text: str, expected: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_message("pkg/msg/Bad", text, "bad.msg")
    assert str(caught.value) == expected


@pytest.mark.parametrize(("text", "expected"), SERVICES)
def test_malformed_services(text: str, expected: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_service("pkg/srv/Bad", text, "bad.srv")
    assert str(caught.value) == expected


@pytest.mark.parametrize(("text", "expected"), ACTIONS)
def test_malformed_actions(text: str, expected: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_action("pkg/action/Bad", text, "bad.action")
    assert str(caught.value) == expected


def test_there_are_enough_malformed_definitions() -> None:
    assert len({*MESSAGES, *SERVICES, *ACTIONS}) >= 60


# Any text is read, or refused with a place inside of it.

FRAGMENTS = st.sampled_from(
    [
        *("int32", "string", "wstring", "time", "Header", "Foo", "a/B", "a/msg/B", "byte", "char"),
        *("[", "]", "<=", "3", "0", "-1", "x", "Y", "=", "#", '"', "'", ",", " ", "  ", "\t", "\n"),
        *("---\n", "\r\n", "[]", "[<=2]", "1.5", "true", "\\", "@key", "\ufeff", "é", "\0"),
    ]
)
TEXTS = st.one_of(
    st.text(max_size=60),
    st.lists(FRAGMENTS, max_size=30).map("".join),
    st.builds(
        lambda text, at, junk: (
            text[: at % (len(text) + 1)] + junk + text[at % (len(text) + 1) + 1 :]
        ),
        st.sampled_from([file.read_text("utf-8") for file in sorted(INTERFACES.glob("*/*/*.*"))]),
        st.integers(0, 5000),
        st.lists(FRAGMENTS, max_size=3).map("".join),
    ),
)


@given(TEXTS)
def test_any_text_is_read_or_refused(text: str) -> None:
    lines = text.removeprefix("\ufeff").replace("\r\n", "\n").split("\n")
    for parse in (parse_message, parse_service, parse_action):
        refusal = None
        try:
            parse("pkg/msg/Any", text, "any")
        except DefinitionError as error:
            refusal = error
        if refusal is not None:
            assert 1 <= refusal.line <= len(lines)
            assert 1 <= refusal.column <= len(lines[refusal.line - 1]) + 1
            assert refusal.reason
