from __future__ import annotations

import array
import datetime as dt
import enum
import math
from collections import OrderedDict
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from hypothesis import given

from rosz.errors import ParamError
from rosz.params.values import convert, copy, normalise, type_name

from .strategies import VALUES


class Text(str):
    __slots__ = ()

    def __str__(self) -> str:
        return "something else"


class Colour(enum.StrEnum):
    RED = "red"


class Level(enum.IntEnum):
    HIGH = 3


class Fraction(float):
    pass


LOOP: list[Any] = []
LOOP.append(LOOP)


@given(VALUES)
def test_values_pass_as_they_are(value: Any) -> None:
    kept = normalise(value)
    assert kept == value
    assert type(kept) is type(value)
    assert repr(copy(kept)) == repr(value)


@pytest.mark.parametrize(
    ("given_value", "kept"),
    [
        ((1, (2, "x")), [1, [2, "x"]]),
        (OrderedDict(b=1, a=(2,)), {"b": 1, "a": [2]}),
        (Text("plain"), "plain"),
        (Colour.RED, "red"),
        (Level.HIGH, 3),
        (Fraction(1.5), 1.5),
        (bytearray(b"ab"), b"ab"),
        (memoryview(b"ab"), b"ab"),
        ({Text("k"): 1}, {"k": 1}),
        (array.array("d", [1, 2]), [1.0, 2.0]),
        (np.float32(1.5), 1.5),
        (np.int64(7), 7),
        (np.bool_(True), True),  # a value, not a flag
        (np.array([[1, 2], [3, 4]]), [[1, 2], [3, 4]]),
        ({"m": np.zeros(2)}, {"m": [0.0, 0.0]}),
    ],
)
def test_relatives_become_the_stores_own_types(given_value: Any, kept: Any) -> None:
    found = normalise(given_value)
    assert found == kept
    assert repr(found) == repr(kept)


def test_a_zone_becomes_its_offset() -> None:
    moment = dt.datetime(2024, 7, 1, 12, tzinfo=ZoneInfo("Europe/Berlin"))
    kept = normalise(moment)
    assert kept == moment
    assert kept.tzinfo == dt.timezone(dt.timedelta(hours=2))


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (None, "'/p' cannot be set: null is not a parameter value; delete the parameter"),
        ({"a": [1, {"b": None}]}, "'/p' cannot be set: at /a[1]/b: null"),
        (1 << 63, "'/p' cannot be set: the int 0x8000000000000000 does not fit 64 bits"),
        (
            -(1 << 63) - 1,
            "does not fit 64 bits; expected -9223372036854775808 to 9223",
        ),
        ({1: 2}, "'/p' cannot be set: the key 1 is a int; expected a str"),
        ({"a", "b"}, "'/p' cannot be set: a set is not a parameter value; expected bool, int"),
        (1j, "a complex is not a parameter value"),
        ("a\ud800b", r"character '\\ud800' at position 2 is half of a surrogate pair"),
        ({"\udfff": 1}, r"character '\\udfff' at position 1"),
        (
            {"x" * 2000: {"y" * 2100: 1}},
            "at /x{60}/y{60}: its name would have more than 4096 bytes",
        ),
        (LOOP, "nested more than 100 deep, or contains itself"),
    ],
)
def test_what_cannot_be_kept_is_refused_with_its_place(value: Any, message: str) -> None:
    with pytest.raises(ParamError, match=message.replace("[", r"\[")):
        normalise(value, "/p")


def test_copies_share_nothing() -> None:
    value = {"a": [1, {"b": 2}]}
    again = copy(value)
    again["a"][1]["b"] = 3
    again["a"].append(4)
    assert value == {"a": [1, {"b": 2}]}


@pytest.mark.parametrize(
    ("value", "wanted", "expected"),
    [(1, float, 1.0), (1.5, float, 1.5), (True, bool, True), ([1], list, [1]), ("x", str, "x")],
)
def test_typed_reads_convert_an_int_to_a_float_and_nothing_else(
    value: Any, wanted: type, expected: Any
) -> None:
    found = convert(value, wanted, "/p", "")
    assert found == expected
    assert type(found) is wanted


@pytest.mark.parametrize(
    ("value", "wanted", "message"),
    [
        ("ten", float, r"parameter '/p' is the str 'ten' \(set by x.launch:3\); expected float"),
        (True, int, "is the bool True"),
        (1, bool, "is the int 1 .* expected bool"),
        (1.0, int, "is the float 1.0 .* expected int"),
        ("x" * 99, int, r"is the str 'x{56}\.\.\. "),
        ("x", complex, "no parameter has the type 'complex'"),
    ],
)
def test_typed_reads_refuse_and_say_who_set_it(value: Any, wanted: type, message: str) -> None:
    with pytest.raises(ParamError, match=message):
        convert(value, wanted, "/p", "x.launch:3")


def test_types_have_names() -> None:
    assert [type_name(value) for value in (1, None, dt.datetime.now(dt.UTC), math)] == [
        "int",
        "null",
        "timestamp",
        "module",
    ]
