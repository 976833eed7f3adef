"""The store against ROS 1's own tree, and its command line's merges against rosparam's."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracle import Worker

from rosz.errors import ParamError
from rosz.params.history import History
from rosz.params.paths import climb, joined, split
from rosz.params.tree import MISSING, leaves, lookup
from rosz.params.writes import DELETED, Change, condense, put, spread
from rosz.params.yaml import dump, load_documents

from .strategies import BELOW_ROOT, DICTS, PARTS, PATHS, VALUES

NAMES = PATHS.map(joined)
# Of a document that is one number, rosparam asks whether it contains "_ns", and fails.
DOCUMENTS = st.one_of(DICTS, st.lists(VALUES, max_size=3), PARTS)
SPACES = st.sampled_from(["/", "/a", "/a/b", "/q"])
STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("set"), BELOW_ROOT.map(joined), VALUES),
        st.tuples(st.just("set"), st.just("/"), st.one_of(DICTS, VALUES)),
        st.tuples(st.just("delete"), NAMES, st.none()),
        st.tuples(st.just("get"), NAMES, st.none()),
        st.tuples(st.just("search"), st.lists(PARTS, min_size=1, max_size=3).map("/".join), NAMES),
    ),
    max_size=16,
)


class Sequential:
    """One user of the store after the other, as on ROS 1's master."""

    def __init__(self) -> None:
        self.history = History()
        self._time = 0

    def step(self, kind: str, name: str, value: Any) -> Any:
        self._time += 1
        stamp = (self._time, "c")
        if kind == "search":
            return climb(name, value, self._exists)
        path = split(name)
        found = lookup(self.history.root, path)
        if kind == "set":
            if not path and not isinstance(value, dict):
                return "KeyError"
            self.history.apply([put(path, stamp, value)])
            return None
        if found is MISSING or (kind == "delete" and not path):
            return "KeyError"
        if kind == "delete":
            self.history.apply([put(path, stamp, DELETED)])
            return None
        return found

    def _exists(self, name: str) -> bool:
        return lookup(self.history.root, split(name)) is not MISSING


@given(STEPS)
def test_every_sequential_history_gives_ros_1s_tree(
    ros1: Worker, steps: list[tuple[str, str, Any]]
) -> None:
    ours = Sequential()
    results = [ours.step(*step) for step in steps]
    theirs, tree, names = ros1.call("history", steps)
    assert results == [_one_word(result) for result in theirs]
    assert ours.history.root == tree
    assert sorted(joined(path) for path, _ in leaves(ours.history.root) if path) == names


def _one_word(result: Any) -> Any:
    """ROS 1 trips over a leaf that a name goes through, and then raises something else."""
    return "KeyError" if result in ("TypeError", "AttributeError") else result


@given(
    DICTS, st.lists(DOCUMENTS, min_size=1, max_size=3), st.sampled_from(["/", "/a", "/a/b", "/q"])
)
def test_loading_merges_as_rosparam_does(
    ros1: Worker, start: dict[str, Any], documents: list[Any], namespace: str
) -> None:
    text = "".join(f"---\n{dump(document)}" for document in documents if _plain(document))
    failed, expected = ros1.call("load", start, text, namespace)
    ours = History()
    ours.apply([put((), (1, "c"), start)])
    try:
        changes = merged(text, namespace)
    except ParamError as error:
        refused: str | None = str(error)
    else:
        refused = None
        ours.apply([put(path, (2, "c"), value) for path, value in changes])
        assert ours.root == expected
    assert failed == ("RosParamException" if refused else None)


def merged(text: str, namespace: str) -> list[Change]:
    return condense(
        change
        for space, value in load_documents(text, namespace)
        for change in spread(space, value)
    )


def _plain(value: Any) -> bool:
    """Leave out what rosparam of Python 3 cannot print or send."""
    if isinstance(value, dict):
        return all(_plain(item) for item in value.values())
    if isinstance(value, list):
        return all(_plain(item) for item in value)
    return not isinstance(value, int) or isinstance(value, bool) or abs(value) < 1 << 31


@pytest.mark.parametrize(
    ("text", "namespace"),
    [
        ("a/b: 1\na: 5", "/"),
        ("a: 5\na/b: 1", "/"),
        ("/a: 1\nb: {/c: 2, d: 3}", "/ns"),
        ("_ns: inner\nx: 1", "/outer"),
        ("_ns: /global\nx: 1", "/outer"),
        ("_ns: deep/er\nx: {y: 1}\n---\nz: 2", "/"),
        ("a: {}\nb: {c: {}}", "/"),
        ("[1, 2]", "/list"),
        ("text", "/leaf"),
        ("", "/"),
        ("a: 1\n---\na: {b: 2}\n---\na: {c: 3}", "/"),
        ("a//b: 1\nc/: 2", "/n"),
    ],
)
def test_odd_files_load_as_rosparam_loads_them(ros1: Worker, text: str, namespace: str) -> None:
    start = {"a": {"old": 1}, "ns": 3}
    failed, expected = ros1.call("load", start, text, namespace)
    assert failed is None
    ours = History()
    ours.apply([put((), (1, "c"), start)])
    ours.apply([put(path, (2, "c"), value) for path, value in merged(text, namespace)])
    assert ours.root == expected


def test_the_root_cannot_be_loaded_with_a_leaf(ros1: Worker) -> None:
    assert ros1.call("load", {}, "5", "/")[0] is not None
    with pytest.raises(ParamError, match="'/' can only be set to a dict, not to the int 5"):
        list(spread("/", 5))


def test_a_private_key_is_refused_where_there_is_no_node() -> None:
    with pytest.raises(ParamError, match="the key '~x' in '/ns' is private"):
        list(spread("/ns", {"~x": 1}))
