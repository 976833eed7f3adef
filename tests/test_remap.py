from __future__ import annotations

import pytest

from rosz import remap
from rosz.errors import InvalidName


def test_every_kind() -> None:
    argv = ["--rate", "a:=b", "_gain:=2", "__name:=n", "__ns:=/x", "file.txt", "c:=", ":=d"]
    found = remap.parse(argv)
    assert found.remaps == {"a": "b"}
    assert found.params == {"gain": "2"}
    assert found.special == {"__name": "n", "__ns": "/x"}
    assert found.rest == ("--rate", "file.txt", ":=d")


def test_what_leads_to_nothing_counts_for_nothing() -> None:
    """As in rospy: a launch file may well leave the value of a remapping empty."""
    found = remap.parse(["chatter:=", "__name:=", "__ns:= ", "_gain:="])
    assert found == remap.Arguments()
    assert found.node_name("talker", "/robot") == "/robot/talker"


def test_later_ones_win_and_values_may_hold_the_sign() -> None:
    found = remap.parse(["_url:=a:=b", "x:=1", "x:=2"])
    assert found.params == {"url": "a:=b"}
    assert found.remaps == {"x": "2"}


@pytest.mark.parametrize(
    ("argv", "namespace", "name"),
    [
        ([], "", "/talker"),
        ([], "/robot", "/robot/talker"),
        ([], "robot/", "/robot/talker"),
        (["__ns:=/x"], "/robot", "/x/talker"),
        (["__name:=t2"], "/robot", "/robot/t2"),
    ],
)
def test_node_name(argv: list[str], namespace: str, name: str) -> None:
    assert remap.parse(argv).node_name("talker", namespace) == name


def test_bad_names_are_refused() -> None:
    with pytest.raises(InvalidName):
        remap.parse(["__name:=a/b"]).node_name("talker")
    with pytest.raises(InvalidName):
        remap.parse(["a b:=c"]).resolved_remaps("/n")


def test_both_sides_resolve_as_the_node_sees_them() -> None:
    found = remap.parse(["a:=b", "~c:=/d", "/e:=~f"]).resolved_remaps("/ns/n")
    assert found == {"/ns/a": "/ns/b", "/ns/n/c": "/d", "/e": "/ns/n/f"}
