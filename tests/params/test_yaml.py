from __future__ import annotations

import datetime as dt
import itertools
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracle import Worker

from rosz.errors import YamlError
from rosz.params.values import normalise
from rosz.params.yaml import dump, format_get, load, load_all, load_documents, pretty, read_plain

from .strategies import VALUES

TEXTS = [
    "1",
    "1.0",
    "one",
    "true",
    "[1, 2, 3]",
    "{a: b, c: d}",
    "yes",
    "OFF",
    "0x1F",
    "017",
    "0o17",
    "1_000",
    "1e3",
    "1.0e+3",
    ".5",
    "-.inf",
    "190:20:30",
    "'1'",
    '"a\\tb"',
    "|\n  block\n  text\n",
    ">\n  folded\n  text\n",
    "deg(90)",
    "rad(pi/2)",
    "rad(2*pi)",
    "!degrees 180",
    "!radians -pi/4",
    "!radians 3.14",
    "!radians math.sqrt(2)",
    "!degrees deg(45)",
    "deg(90)x",
    "degrees",
    "rad()x",
    "!!binary aGVsbG8=",
    "!!str 5",
    "!!int '7'",
    "!!float 3",
    "2001-12-14",
    "2001-12-14 21:59:43",
    "2001-12-14t21:59:43.10-05:00",
    "a: 1\nb:\n  - x\n  - {y: 2}\n",
    "--- 1\n--- 2\n...\n--- [3]",
    "base: &b {x: 1, y: 2}\nmore: {<<: *b, y: 3}",
    "list: &l [1, 2]\nagain: *l",
    "m: {<<: [{a: 1}, {a: 2, b: 3}], c: 4}",
    "dup: 1\ndup: 2",
    "=: 3",
    "# nothing",
    "",
    "'': 1",
    "ü: ß",
    "a b: {'*?#': 1}",
]


@pytest.mark.parametrize("text", TEXTS)
def test_texts_mean_what_they_mean_to_rosparam(ros1: Worker, text: str) -> None:
    failed, values = ros1.call("read", text)
    assert failed is None
    found = load_all(text)
    assert found == values
    assert repr(found) == repr(values)


@pytest.mark.parametrize(
    ("text", "place", "reason"),
    [
        ("a: 1\nb: [1, 2", "3:1", "while parsing a flow sequence"),
        ("{a: ", "2:1", "while parsing a flow"),
        ("a: b: c", "1:5", "mapping values are not allowed"),
        ("\ta: 1", "1:1", "found character that cannot start any token"),
        ("a: *x", "1:4", r"the alias '\*x' names no anchor"),
        ("[&a 1, &a 2]", "1:8", "the anchor '&a' is taken"),
        ("a: 1\nb: ~", "2:4", "null is not a parameter value"),
        ("a:\nb: 1", "1:3", "null is not a parameter value"),
        ("a: 1\n2: 3", "2:1", "the key 2 is int: dictionaries must have string keys"),
        ("yes: 1", "1:1", "the key True is bool"),
        ("x: {? [a] : 1}", "1:7", r"the key \['a'\] is list"),
        ("x: 9223372036854775808", "1:4", "does not fit 64 bits"),
        ("a: &x\n  - *x", "1:4", "it contains itself"),
        ("!!set {a}", "1:1", "the tag '!!set' means nothing"),
        ("x: !foo y", "1:4", "could not determine a constructor for the tag '!foo'"),
        ("x: !degrees y", "1:4", "'y' is not an angle in degrees"),
        ("x: !degrees [1]", "1:4", "the tag '!degrees' means nothing"),
        (
            "x: rad(1/0)",
            "1:4",
            "in radians; expected arithmetic with numbers and pi",
        ),
        ("x: rad(foo)", "1:4", "is not an angle in radians"),
        ("x: !radians __import__('os')", "1:4", "is not an angle in radians"),
        ("x: !radians 9**9**9**9", "1:4", "is not an angle in radians"),
        ("x: !radians (-1)**0.5", "1:4", "is not an angle in radians"),
        ("x: !radians " + "1+" * 200 + "1", "1:4", "is not an angle in radians"),
        ("x: 2001-99-14", "1:4", "is not a !!timestamp: month must be in"),
        ("x: !!binary é", "1:4", "failed to convert base64 data"),
        ("x: !!bool maybe", "1:4", "'maybe' is not a !!bool"),
        ("x: !!int ''", "1:4", "'' is not a !!int"),
        ("a: \x07", "1:4", r"the character U\+0007 is not allowed"),
        ("%YAML 3.0\n---\na", "1:1", "incompatible YAML"),
        ("[" * 5000, "1:102", "nested more than 100 deep"),
        ("{a: " * 5000, "1:402", "nested more than 100 deep"),
        ("<<: 1\na: 2", "1:5", "expected a mapping or list of mappings for merging, but found"),
    ],
)
def test_what_cannot_be_read_is_told_with_its_place(text: str, place: str, reason: str) -> None:
    with pytest.raises(YamlError, match=reason) as caught:
        load_all(text, "file.yaml")
    assert caught.value.place == f"file.yaml:{place}"


def _bomb(levels: int) -> str:
    names = [f"a{level}" for level in range(levels)]
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [
        f"{name}: &{name} [{', '.join([f'*{below}'] * 9)}]"
        for below, name in itertools.pairwise(names)
    ]
    return "\n".join(lines)


def test_a_bomb_of_aliases_is_refused_by_its_name() -> None:
    with pytest.raises(YamlError, match=r"aliases repeat more than 100000 values.* YAML bomb"):
        load(_bomb(12))


def test_a_bomb_of_merges_is_refused_by_its_name() -> None:
    lines = ["m0: &m0 {x: 1}"]
    lines += [f"m{i}: &m{i} {{<<: [{', '.join([f'*m{i - 1}'] * 9)}]}}" for i in range(1, 12)]
    with pytest.raises(YamlError, match="YAML bomb"):
        load("\n".join(lines))


def test_aliases_that_nest_ever_deeper_are_refused() -> None:
    lines = ["d0: &d0 [1]"]
    lines += [f"d{i}: &d{i} {'[' * 50}*d{i - 1}{']' * 50}" for i in range(1, 30)]
    with pytest.raises(YamlError, match="nested more than 100 deep"):
        load("\n".join(lines))


def test_aliases_become_copies() -> None:
    found = load("a: &l [1]\nb: *l")
    found["a"].append(2)
    assert found == {"a": [1, 2], "b": [1]}


def test_one_document_is_expected_where_one_value_is() -> None:
    assert load("") == ""
    with pytest.raises(YamlError, match="2 documents, expected one"):
        load("--- 1\n--- 2")
    with pytest.raises(YamlError, match="nothing but comments"):
        load("# hm")


@pytest.mark.parametrize("text", ["_ns: 5\na: 1", "_ns: ~b\na: 1"])
def test_a_namespace_in_a_file_is_a_name(text: str) -> None:
    with pytest.raises(YamlError, match="expected the name of a namespace"):
        load_documents(text)


@pytest.mark.parametrize(
    ("text", "angle"),
    [
        ("deg(180)", math.pi),
        ("deg( -90 )", -math.pi / 2),
        ("rad(pi)", math.pi),
        ("rad(-pi/2 + 1)", 1 - math.pi / 2),
        ("rad(7//2)", 3.0),
        ("rad(7%4)", 3.0),
        ("rad(2**3)", 8.0),
        ("!radians (1+2)*pi", 3 * math.pi),
        ("!radians math.cos(0)", 1.0),
        ("!radians math.tau", math.tau),
    ],
)
def test_angles(text: str, angle: float) -> None:
    assert load(text) == pytest.approx(angle)


def _printable(value: Any) -> bool:
    """Tell whether rosparam of Python 3 can print it: it cannot print bytes."""
    if isinstance(value, dict):
        return all(_printable(item) for item in value.values())
    if isinstance(value, list):
        return all(_printable(item) for item in value)
    return not isinstance(value, bytes)


@given(VALUES.filter(_printable))
def test_printing_is_rosparams(ros1: Worker, value: Any) -> None:
    assert [dump(value), format_get(value), pretty(value)] == ros1.call("show", value)


LONG = "word " * 40


@pytest.mark.parametrize(
    "value",
    [
        "",
        "1",
        "true",
        "null",
        "noetic\n",
        "a\n\nb",
        LONG,
        f"{LONG}\n{LONG}",
        "tab\there",
        "ünïcode",
        "😀",
        "- dash",
        "key: value",
        "'quoted'",
        "#",
        " lead",
        "trail ",
        "\x00",
        1e20,
        1e-7,
        math.inf,
        -0.0,
        [],
        {},
        [[], {}],
        {"a": {}, "b": []},
        {"z": 1, "a": {"y": [1, {"x": 2}]}},
        dt.date(2001, 12, 14),
        dt.datetime(2001, 12, 14, 21, 59, 43, 5, tzinfo=dt.UTC),
        {"multi": "one\ntwo", "list": [1, "a\nb"], "n": 1.5},
    ],
)
def test_odd_values_print_as_rosparam_prints_them(ros1: Worker, value: Any) -> None:
    assert [dump(value), format_get(value), pretty(value)] == ros1.call("show", value)


@given(VALUES)
def test_what_is_written_reads_back(value: Any) -> None:
    again = load(dump(value))
    assert again == value
    assert dump(again) == dump(value)


def test_bytes_are_written_as_binary() -> None:
    assert dump({"b": b"hello"}) == "b: !!binary |\n  aGVsbG8=\n"
    assert format_get(b"hello") == "!!binary |\n  aGVsbG8=\n\n"


@given(st.text(st.characters(exclude_categories=["Cs"]), max_size=40))
def test_any_text_is_a_value_or_the_named_error(text: str) -> None:
    try:
        found = load_all(text)
    except YamlError:
        return
    for value in found:
        assert normalise(value) == value or value != value  # noqa: PLR0124  # nan


@given(st.text(st.sampled_from(list("{}[]:,-&*!<>|'\"#%@?~ \n\tab01._")), max_size=30))
def test_any_punctuation_is_a_value_or_the_named_error(text: str) -> None:
    try:
        load_all(text)
    except YamlError:
        return


@pytest.mark.parametrize("tag", ["!!map", "!!seq", "!!set", "!!omap", "!!pairs"])
def test_a_scalar_is_not_read_as_what_its_tag_says(tag: str) -> None:
    for text in ("", "ab"):
        with pytest.raises(YamlError, match="but found scalar"):
            load_all(f"x: {tag} '{text}'")


def test_aliases_are_counted_for_each_document() -> None:
    document = f"--- \na: &a [{'x, ' * 60_000}]\nb: *a\n"
    assert [len(value["b"]) for value in load_all(document * 2)] == [60_000, 60_000]


def test_plain_text_that_contains_itself_is_refused_with_its_place() -> None:
    with pytest.raises(YamlError, match="p:1:1: it contains itself"):
        list(read_plain("&a [*a]", "p"))
