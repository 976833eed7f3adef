"""Whatever a person writes is a value, or an error that names its place; never anything else."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from rosz.errors import UsageError, YamlError
from rosz.introspect.arguments import read_arguments, read_file, read_stream

BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12)
)
SPIRAL = "d0: &d0 [1]\n" + "".join(
    f"d{i}: &d{i} {'[' * 50}*d{i - 1}{']' * 50}\n" for i in range(1, 30)
)
REFUSED = {
    "2020-13-45": "'2020-13-45' is not a !!timestamp: month must be in 1..12",
    "!!int x": "'x' is not a !!int",
    "!!timestamp x": "'x' is not a !!timestamp",
    "9" * 5000: "is not a !!int: Exceeds the limit",
    "[" * 20_000: "it is nested more than 100 deep",
    BOMB: "this looks like a YAML bomb",
    SPIRAL: "it is nested more than 100 deep",
    "{a: *b}": "the alias '*b' names no anchor",
    "{? [1]: 2}": "found unhashable key",
    "\ud800": "half of a surrogate pair",
    "!!python/name:os.system": "could not determine a constructor",
}


@pytest.mark.parametrize(("text", "reason"), REFUSED.items(), ids=range(len(REFUSED)))
def test_what_is_no_value(text: str, reason: str) -> None:
    with pytest.raises(UsageError) as caught:
        read_arguments(["1", text])
    assert str(caught.value).startswith("value 2, '")
    assert reason in str(caught.value)


def test_values() -> None:
    words = ["", "1", "~", "{a: &x [1], b: *x}", "18446744073709551615", "!!binary aGk=", "# none"]
    values = ["", 1, None, {"a": [1], "b": [1]}, 2**64 - 1, b"hi", None]
    assert read_arguments(words) == values


def test_one_value_for_each_argument() -> None:
    with pytest.raises(UsageError, match="is 2 YAML documents; expected one"):
        read_arguments(["1\n---\n2"])


@pytest.mark.parametrize(
    ("content", "place"),
    [(b"a: 1\n---\nb: 2020-13-45", "3:4"), (b"a: 1\nb: \xff", "2"), (b"a: b: c", "1:5")],
)
def test_a_file_that_cannot_be_read(content: bytes, place: str, tmp_path: Path) -> None:
    file = tmp_path / "f.yaml"
    file.write_bytes(content)
    with pytest.raises(YamlError) as caught:
        read_file(file)
    assert caught.value.place == f"{file}:{place}"


def test_a_stream_tells_the_line_of_the_whole() -> None:
    stream = io.BytesIO("a: é\n---\n\n---\nb: 1\nc: [\n---\n".encode())
    found = read_stream(stream, pytest.fail)
    assert next(found) == {"a": "é"}
    with pytest.raises(YamlError) as caught:
        next(found)
    assert caught.value.place.startswith("standard input:7")


def test_a_stream_of_other_bytes() -> None:
    with pytest.raises(YamlError, match=r"standard input:2: byte 0xff is not UTF-8"):
        list(read_stream(io.BytesIO(b"a: 1\n\xff\n---\n"), pytest.fail))


@pytest.mark.parametrize(("end", "said"), [("", 0), ("\n\n", 0), ("b: 2\n", 1), ("---\nb: 2", 1)])
def test_a_document_that_does_not_end_is_told(end: str, said: int) -> None:
    told: list[str] = []
    stream = io.BytesIO(f"a: 1\n---\n{end}".encode())
    assert list(read_stream(stream, told.append)) == [{"a": 1}]
    left_out = "standard input ends without a line '---': what comes after the last one is left out"
    assert told == [left_out] * said
