from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosz import names
from rosz.errors import InvalidName

SYSTEM_PYTHON = "/usr/bin/python3"
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


WORKER = """
import json, sys
from rosgraph import names
for line in sys.stdin:
    name, node = json.loads(line)
    print(json.dumps([names.is_legal_name(name), names.resolve_name(name, node)]))
"""


def test_resolves_as_rosgraph_does() -> None:
    found = (
        subprocess.run(
            [SYSTEM_PYTHON, "-c", "import rosgraph.names"], capture_output=True, check=False
        )
        if Path(SYSTEM_PYTHON).exists()
        else None
    )
    if found is None or found.returncode:
        pytest.skip("ROS 1's rosgraph is not installed")
    pieces = ["", "a", "/a", "~a", "a/b", "~", "/", "a/", "~/a", "/a/b/", "b_1/c"]
    cases = [(name, node) for name in pieces for node in ("/n", "/ns/n", "/a/b/n")]
    answers = subprocess.run(
        [SYSTEM_PYTHON, "-c", WORKER],
        input="".join(json.dumps(case) + "\n" for case in cases),
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    for (name, node), answer in zip(cases, answers, strict=True):
        legal, resolved = json.loads(answer)
        assert names.is_valid(name) == bool(legal), name
        assert names.resolve(name, node) == resolved, (name, node)
