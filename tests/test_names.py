from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracle import real

from rosz import names
from rosz.errors import InvalidName
from rosz.remap import Arguments

VALID = ["", "a", "/", "/a", "a/b", "/a/b_1", "~a", "~", "~/a", "A9", "/a/"]
INVALID = {
    "1a": "starts with '1'",
    "_a": "starts with '_'",
    "-": "starts with '-'",
    "a b": "character ' ' at position 2",
    "a//b": "an empty part",
    "/a-b": "character '-' at position 3",
    "a~b": "character '~' at position 2",
    "é": "starts with 'é'",
    "aé": "character 'é' at position 2",
    "a\n": "character '\n' at position 2",
}


@pytest.mark.parametrize("name", VALID)
def test_valid(name: str) -> None:
    assert names.is_valid(name)
    assert names.check(name) == name


@pytest.mark.parametrize(("name", "reason"), INVALID.items())
def test_invalid(name: str, reason: str) -> None:
    assert not names.is_valid(name)
    with pytest.raises(InvalidName, match=reason):
        names.check(name)


@pytest.mark.parametrize(
    "check",
    [
        names.check,
        names.check_base,
        names.check_resource,
        names.check_length,
        lambda name: names.resolve(name, "/node"),
        lambda name: names.resolve(name[:1000], "/" + name[:1000] + "/node"),
        lambda name: Arguments(special={"__ns": name[:1000]}).node_name(name[:1000]),
    ],
)
def test_names_that_are_too_long(check: Callable[[str], object]) -> None:
    """Zenoh would panic, and with it end what uses its session."""
    long = "x" * 66_000
    with pytest.raises(InvalidName, match=r"it has \d+ bytes; the limit is 1024") as caught:
        check(long)
    assert len(str(caught.value)) < 300
    assert not names.is_valid(long)


def test_the_longest_name() -> None:
    longest = "/" + "x" * (names.LONGEST_NAME - 1)
    assert names.check(longest) == names.resolve(longest, "/node") == longest
    with pytest.raises(InvalidName, match="it has 1026 bytes"):
        names.check_length("é" * 513)


@given(st.text())
def test_check_agrees_with_is_valid(name: str) -> None:
    if names.is_valid(name):
        names.check(name)
    else:
        with pytest.raises(InvalidName):
            names.check(name)


@pytest.mark.parametrize(
    ("name", "reason"),
    [("", "empty"), ("a/b", "contains '/'"), ("~a", "a letter first"), ("1", "starts with '1'")],
)
def test_base_names(name: str, reason: str) -> None:
    assert names.check_base("talker_1") == "talker_1"
    with pytest.raises(InvalidName, match=reason):
        names.check_base(name)


@pytest.mark.parametrize(
    ("name", "node", "resolved"),
    [
        ("", "/ns/n", "/ns/"),
        ("a", "/n", "/a"),
        ("a", "/ns/n", "/ns/a"),
        ("a/b", "/ns/n", "/ns/a/b"),
        ("/a", "/ns/n", "/a"),
        ("~a", "/ns/n", "/ns/n/a"),
        ("~", "/ns/n", "/ns/n"),
        ("~/a", "/n", "/n/a"),
        ("/a/", "/n", "/a"),
        ("/", "/n", "/"),
    ],
)
def test_resolve(name: str, node: str, resolved: str) -> None:
    assert names.resolve(name, node) == resolved


def test_remaps_apply_to_what_a_name_means() -> None:
    remaps = {"/ns/a": "/b", "/ns/n/c": "/d"}
    assert names.resolve("a", "/ns/n", remaps) == "/b"
    assert names.resolve("/ns/a", "/ns/n", remaps) == "/b"
    assert names.resolve("~c", "/ns/n", remaps) == "/d"
    assert names.resolve("/a", "/ns/n", remaps) == "/a"


@pytest.mark.parametrize(
    ("name", "parent"), [("/a/b/c", "/a/b/"), ("/a", "/"), ("/", "/"), ("a", "/"), ("", "/")]
)
def test_namespace(name: str, parent: str) -> None:
    assert names.namespace(name) == parent


def test_parts() -> None:
    assert names.basename("/a/b") == "b"
    assert names.canonical("//a///b/") == "/a/b"
    assert names.join("/ns", "a") == "/ns/a"
    assert names.join("/ns", "/a") == "/a"
    assert names.anonymous("n", "my-host.lan", 12, 34) == "n_my_host_lan_12_34"


@pytest.mark.ros1
def test_resolves_as_rosgraph_does() -> None:
    pieces = ["", "a", "/a", "~a", "a/b", "~", "/", "a/", "~/a", "/a/b/", "b_1/c"]
    cases = [(name, node) for name in pieces for node in ("/n", "/ns/n", "/a/b/n")]
    snippet = """
        from rosgraph import names
        result = [[names.is_legal_name(n), names.resolve_name(n, node)] for n, node in given]
    """
    expected = real(snippet, "rosgraph.names", "python3-rosgraph", given=cases)
    for (name, node), (legal, resolved) in zip(cases, expected, strict=True):
        assert names.is_valid(name) == bool(legal), name
        assert names.resolve(name, node) == resolved, (name, node)
