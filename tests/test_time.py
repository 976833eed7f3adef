"""Times and durations against genpy's."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import Worker, require

from rosz.msgs.builtin_interfaces.msg import Duration as DurationMessage
from rosz.msgs.builtin_interfaces.msg import Time as TimeMessage
from rosz.time import ClassicConstructor, DurationValue, TimeValue, normal


class Time(TimeMessage, metaclass=ClassicConstructor):
    pass


class Duration(DurationMessage, metaclass=ClassicConstructor):
    pass


@pytest.fixture(scope="module")
def genpy() -> Iterator[Worker]:
    require("genpy", "std_msgs.msg", package="python3-genpy, python3-std-msgs")
    worker = Worker("genpy_calls")
    yield worker
    worker.close()


def shown(value: Any) -> Any:
    if isinstance(value, TimeValue | DurationValue):
        kind = "Time" if isinstance(value, TimeValue) else "Duration"
        return [kind, value.secs, value.nsecs, str(value)]
    plain = list(map(shown, value)) if isinstance(value, tuple) else value
    return [type(value).__name__, plain]


def outcome(expression: str) -> dict[str, Any]:
    try:
        return {"value": shown(eval(expression, {"Time": Time, "Duration": Duration}))}
    except Exception as error:  # noqa: BLE001  # the outcome is which one it is
        return {"error": type(error).__name__}


def agree(genpy: Worker, expression: str) -> None:
    theirs = genpy.call("evaluate", expression)
    assert outcome(expression) == theirs, expression


EXPRESSIONS = """
Time() == Time(0, 0)
Time(1.5)
Time(1, 2500000000)
Time(2, -1)
Time(-1)
Time(0, -1)
Time(-0.5)
Time(1.5, 1)
Time(secs=3)
Time(nsecs=3)
Time(secs=1.25)
Time(True)
Duration(-1, -1)
Duration(-1.5)
Duration(-0.1)
Duration(1e-9)
Duration(0, -2000000000)
Duration(2147483647, 999999999) + Duration(0, 1)
Time(4294967295, 999999999) + Duration(0, 1)
Time(1, 5) - Time(2, 3)
Time(2, 3) - Time(1, 5)
Time(1) - Duration(2)
Time(1) - 1
Time(1) + 1
Time(1) + Time(1)
Duration(1) + Time(1)
Duration(1) - Time(1)
Time(1) + Duration(-1)
Duration(3) * 2
2 * Duration(3, 600000000)
Duration(3) * 0.5
Duration(3) * Duration(1)
Duration(3) * '2'
Duration(3) / 2
Duration(3) / Duration(2)
Duration(3) / 0
Duration(3) // 2
Duration(7) // Duration(2)
Duration(7) // 'x'
Duration(7, 500) % Duration(2)
Duration(7) % 2
divmod(Duration(7, 500000000), Duration(2))
divmod(Duration(7), 2)
-Duration(1, 1)
abs(Duration(-1, 1))
abs(Duration(1, 1))
+Duration(1)
Time(1) < Time(1, 1)
Time(1) < Duration(2)
Time(1) <= 1
Time(1) == Duration(1)
Time(1) == 1
Time(1) != Duration(1)
Duration(1) >= Duration(0, 999999999)
Duration(-1) < Duration(0)
Duration(1) > 'x'
Time(1, 5) == Time(1.000000005)
bool(Time()) or bool(Duration())
bool(Time(0, 1)) and bool(Duration(-1))
hash(Time(1, 2)) == hash(Time(1, 2))
hash(Time(1, 2)) == hash((1, 2))
str(Time(1, 2))
str(Duration(-1, 2))
Time.from_sec(1234567890.987654321)
Duration.from_sec(-1.25)
Time.from_sec(-1)
Time(12, 345678901).to_sec()
Time(12, 345678901).to_time()
Time(12, 345678901).to_nsec()
Duration(-12, 345678901).to_nsec()
Duration(-12, 345678901).to_sec()
Time(0, 0).is_zero()
Duration(0, 1).is_zero()
(Time(1, 1).secs, Time(1, 1).nsecs)
sum([Duration(1), Duration(2)], Duration())
sorted([Time(3), Time(1), Time(2)])[0]
max(Duration(1), Duration(-3))
""".strip().splitlines()


@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_as_genpy(genpy: Worker, expression: str) -> None:
    agree(genpy, expression)


SECONDS = st.one_of(st.integers(-(1 << 33), 1 << 33), st.integers(-3, 3))
NANOSECONDS = st.one_of(st.integers(-(10**10), 10**10), st.integers(-2, 2))
FLOATS = st.floats(-1e9, 1e9, allow_nan=False)
TIMES = st.one_of(
    st.builds("Time({}, {})".format, SECONDS.map(abs), NANOSECONDS),
    st.builds("Time({!r})".format, FLOATS),
)
DURATIONS = st.one_of(
    st.builds("Duration({}, {})".format, SECONDS, NANOSECONDS),
    st.builds("Duration({!r})".format, FLOATS),
)
VALUES = TIMES | DURATIONS
OPERATORS = st.sampled_from(["+", "-", "<", "<=", "==", "!=", ">", ">=", "%", "//", "/", "*"])
OTHERS = VALUES | st.integers(-5, 5).map(str) | st.floats(-5, 5, allow_nan=False).map(repr)
EXPRESSION = st.builds("{} {} {}".format, VALUES, OPERATORS, OTHERS)


@settings(max_examples=400)
@given(expression=EXPRESSION)
def test_any_operation_as_genpy(genpy: Worker, expression: str) -> None:
    agree(genpy, expression)


def test_the_bare_messages_have_the_same_arithmetic() -> None:
    difference = TimeMessage(5, 1) - TimeMessage(3, 2)
    assert (type(difference), repr(difference)) == (
        DurationMessage,
        "Duration(sec=1, nanosec=999999999)",
    )
    assert TimeMessage(1, 0) == Time(1)
    assert Time(1) - TimeMessage(1, 0) == DurationMessage(0, 0)
    assert type(Time(1) + DurationMessage(1, 0)) is Time
    assert type(TimeMessage(1, 0) + Duration(1)) is TimeMessage
    assert TimeMessage(1, 0) < Time(2)


def test_fields_have_the_names_of_both_worlds() -> None:
    time = TimeMessage(sec=1, nanosec=2)
    time.secs, time.nsecs = 3, 1_500_000_000
    assert (time.sec, time.nanosec) == (3, 1_500_000_000)
    time.canon()
    assert (time.secs, time.nsecs) == (4, 500_000_000)
    time.set(7, 8)
    assert time == TimeMessage(7, 8)
    with pytest.raises(AttributeError):
        time.millis = 1  # type: ignore[attr-defined]


def test_from_nanoseconds() -> None:
    assert TimeMessage.from_nsec(1_000_000_002) == TimeMessage(1, 2)
    assert DurationMessage.from_nsec(-1) == DurationMessage(-1, 999_999_999)
    with pytest.raises(TypeError, match="before the epoch, got -1 s"):
        TimeMessage.from_nsec(-1)


@given(SECONDS, NANOSECONDS)
def test_normal_form(secs: int, nsecs: int) -> None:
    sec, nanosec = normal(secs, nsecs)
    assert 0 <= nanosec < 10**9
    assert sec * 10**9 + nanosec == secs * 10**9 + nsecs


def test_copies_and_pickles() -> None:
    for value in (Time(1, 2), Duration(-1, 2), TimeMessage(1, 2)):
        for twin in (copy.copy(value), copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
            assert twin == value
            assert type(twin) is type(value)
    assert issubclass(Time, msgspec.Struct)
    assert Time.from_cdr(Time(1, 2).to_cdr()) == Time(1, 2)
