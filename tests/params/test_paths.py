from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosz import names
from rosz.errors import DecodeError, InvalidName, ParamError
from rosz.params.paths import Path, climb, from_key, joined, resolve, split, to_key

ANY_PART = st.text(
    st.characters(exclude_categories=["Cs"], exclude_characters="/"), min_size=1, max_size=10
)
ANY_PATH: st.SearchStrategy[Path] = st.lists(ANY_PART, max_size=5).map(tuple)
CANONICAL_KEY = re.compile(r"([^*$?#/@\x00-\x1f\x7f]+(/[^*$?#/@\x00-\x1f\x7f]+)*)?")


@given(ANY_PATH)
def test_any_path_survives_the_way_through_a_key(path: Path) -> None:
    key = to_key(path)
    assert CANONICAL_KEY.fullmatch(key)
    assert from_key(key) == path
    assert split(joined(path)) == path


@given(ANY_PATH, ANY_PATH)
def test_different_paths_have_different_keys(left: Path, right: Path) -> None:
    assert (to_key(left) == to_key(right)) == (left == right)


@pytest.mark.parametrize(
    ("path", "key"),
    [
        ((), ""),
        (("a", "b"), "a/b"),
        (("sp ace", "ü"), "sp ace/ü"),
        (("*", "**", "$*", "?", "#", "@v", "100%"), "%2A/%2A%2A/%24%2A/%3F/%23/%40v/100%25"),
        (("line\nbreak\x00",), "line%0Abreak%00"),
    ],
)
def test_only_what_zenoh_forbids_is_escaped(path: Path, key: str) -> None:
    assert to_key(path) == key


@pytest.mark.parametrize("key", ["a//b", "/a", "a/", "%2a", "%41", "a%", "%", "a*", "%FF", "@a"])
def test_a_key_that_no_path_has_is_refused(key: str) -> None:
    with pytest.raises(DecodeError, match="parameter key"):
        from_key(key)


@pytest.mark.parametrize(
    ("name", "path"),
    [("/", ()), ("/a", ("a",)), ("//a//b/", ("a", "b")), ("/a b/~c", ("a b", "~c"))],
)
def test_empty_parts_count_for_nothing(name: str, path: Path) -> None:
    assert split(name) == path


@pytest.mark.parametrize("name", ["a", "~a", ""])
def test_only_global_names_are_paths(name: str) -> None:
    with pytest.raises(InvalidName, match="it is not global"):
        split(name)


@pytest.mark.parametrize("name", ["/a\ud800", "\udcff"])
def test_the_character_that_no_name_can_hold_is_named(name: str) -> None:
    with pytest.raises(InvalidName, match="half of a surrogate pair"):
        resolve(name, "/n")


@pytest.mark.parametrize(
    ("name", "resolved"),
    [
        ("", "/ns/"),
        ("~", "/ns/node"),
        ("~a/b", "/ns/node/a/b"),
        ("a b/*", "/ns/a b/*"),
        ("/", "/"),
        ("//x//", "/x"),
        ("~/a", "/ns/node/a"),
    ],
)
def test_names_resolve_whatever_they_hold(name: str, resolved: str) -> None:
    assert resolve(name, "/ns/node") == resolved


@given(st.from_regex(r"[~/]?[A-Za-z][A-Za-z0-9_]{0,3}(/[A-Za-z0-9_]{1,3}){0,2}", fullmatch=True))
def test_graph_names_resolve_as_they_do_elsewhere(name: str) -> None:
    assert resolve(name, "/ns/node") == names.resolve(name, "/ns/node")


def test_remaps_apply_to_what_is_resolved() -> None:
    assert resolve("~a", "/n", {"/n/a": "/other"}) == "/other"


@pytest.mark.parametrize("name", ["", "~a", "/", "//"])
def test_searching_needs_a_name_that_can_be_anywhere(name: str) -> None:
    with pytest.raises(ParamError, match="cannot search for"):
        climb(name, "/n", lambda _: True)
