"""ROS 2's parameter files, loaded as ROS 2 loads them, into a store that all nodes share."""

from __future__ import annotations

from typing import Any

import pytest

from rosz.errors import YamlError
from rosz.params.yaml import load_documents

FILE = """
/left/arm:
  ros__parameters:
    n: 7
    limits.low: -1
/**:
  ros__parameters: {n: 1, limits: {low: 1, high: 2}}
/left/*: {ros__parameters: {side: left}}
/**/hand: {ros__parameters: {fingers: 5}}
"""

ARM = {"n": 1, "limits": {"low": 1, "high": 2}}


@pytest.mark.parametrize(
    ("node", "found"),
    [
        ("/left/arm", [ARM, {"side": "left"}, {"n": 7, "limits": {"low": -1}}]),
        ("/left/arm/", [ARM, {"side": "left"}, {"n": 7, "limits": {"low": -1}}]),
        ("/right/arm", [ARM]),
        ("/left/a/arm", [ARM]),
        ("/a/b/hand", [ARM, {"fingers": 5}]),
        ("/hand", [ARM, {"fingers": 5}]),
        ("/a/behind/hands", [ARM]),
    ],
)
def test_a_node_takes_what_is_for_it_wildcards_first(node: str, found: list[Any]) -> None:
    name = node.rstrip("/")
    assert load_documents(FILE, node) == [(name, values) for values in found]


def test_the_root_takes_what_is_for_named_nodes() -> None:
    text = "arm: {ros__parameters: {a.b: 1}}\n/ns: {hand: {ros__parameters: {c: 2}}}"
    assert load_documents(text) == [("/arm", {"a": {"b": 1}}), ("/ns/hand", {"c": 2})]


@pytest.mark.parametrize(
    ("text", "namespace", "reason"),
    [
        (FILE, "/", "f.yaml:2:1: '/**' in this parameter file of ROS 2 means any node that reads"),
        (
            "a: {ros__parameters: {x: 1}}\n/n/b: {ros__parameters: {x: 1}}",
            "/c",
            "this parameter file of ROS 2 has nothing for the node '/c', only for '/a', '/n/b'",
        ),
        ("a: {ros__parameters: {x: 1}}\nb: 1", "/", "'b' has no 'ros__parameters'; all values of"),
        ("a: {ros__parameters: 1}", "/", "'ros__parameters' of 'a' is not a dictionary"),
        ("ros__parameters: {a: 1}", "/", "'ros__parameters' stands below no node"),
    ],
)
def test_what_a_store_for_all_nodes_cannot_hold(text: str, namespace: str, reason: str) -> None:
    with pytest.raises(YamlError) as caught:
        load_documents(text, namespace, "f.yaml")
    assert reason in str(caught.value)


def test_files_of_ros_1_are_taken_whole() -> None:
    assert load_documents("/**: {a: 1}", "/n") == [("/n", {"/**": {"a": 1}})]
