"""diagnostic_aggregator: the tree of statuses, compared with that of ROS 1's program."""

from __future__ import annotations

import json
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest
import yaml
from network import TIMEOUT, Network

from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rosz.msgs.std_msgs.msg import Header
from rosz.programs.diagnostic_aggregator import Item, Section

FOLDER = Path(__file__).parent / "diagnostics"
STATUSES = {
    "motor_driver: left": 0, "motor: right": 1, "motor  blank": 2, "ns/gone: a": 0, "ns/gone": 1,
    "a/b": 0, "other": 2, "camera 7": 0, "camera x": 1, "temp of x": 3, "secret plan": 2,
    "one a": 3, "one b": 3, "two c": 0, "nobody's": 1, "weird": 0,
}  # fmt: skip
S = 10**9
START = ("-P", "-m", "rosz", "run", "diagnostic_aggregator", "aggregator_node")


def test_the_tree_is_that_of_ros1(network: Network) -> None:
    """The file beside the program was written with ROS 1's aggregator_node and these statuses."""
    node = network.node("robot")
    parameters = yaml.safe_load((FOLDER / "analyzers.yaml").read_text())
    node.params.set("/diagnostic_aggregator", parameters | {"pub_rate": 50.0})
    trees: SimpleQueue[Any] = SimpleQueue()
    states: SimpleQueue[Any] = SimpleQueue()
    node.subscription("/diagnostics_agg", DiagnosticArray, trees.put)
    node.subscription("/diagnostics_toplevel_state", DiagnosticStatus, states.put)
    publisher = node.publisher("/diagnostics", DiagnosticArray)
    network.run(*START)
    publisher.wait_for_subscribers(1, TIMEOUT)
    values = [KeyValue("k", "v")]
    publisher.publish(
        DiagnosticArray(
            Header(stamp=Time(1)),
            [
                DiagnosticStatus(level, name, f"msg {name}", "hw", values)
                for name, level in STATUSES.items()
            ],
        )
    )
    expected = json.loads((FOLDER / "tree.json").read_text())
    found: list[Any] = []
    while len(found) < len(expected):
        found = trees.get(timeout=TIMEOUT).status
    assert [
        [one.name, one.level, one.message, one.hardware_id, [[v.key, v.value] for v in one.values]]
        for one in found
    ] == expected
    while states.get(timeout=TIMEOUT).level != DiagnosticStatus.ERROR:
        pass


def item(name: str, seconds: int, level: int = 0) -> Item:
    return Item(name, seconds * S, level, "fine")


def levels(section: Section, seconds: float) -> list[int]:
    return [status.level for status in section.report(round(seconds * S))]


def test_old_statuses_are_stale() -> None:
    section = Section("/a", "a", 0, timeout=5.0)
    assert levels(section, 0) == [3]
    section.analyze(item("one", 1))
    section.analyze(item("two", 3, 1))
    assert levels(section, 6) == [1, 0, 1]
    assert levels(section, 7) == [2, 3, 1]
    assert levels(section, 9) == [3, 3, 3]
    section.analyze(item("one", 9))
    assert levels(section, 9) == [2, 0, 3]


def test_stale_statuses_are_discarded() -> None:
    section = Section("/a", "a", 0, timeout=5.0, discard_stale=True)
    section.analyze(item("one", 1))
    assert levels(section, 2) == [0, 0]
    assert levels(section, 7) == [3]
    assert levels(section, 12) == [3]
    assert levels(section, 13) == []
    section.analyze(item("one", 13))
    assert levels(section, 13) == [0, 0]


@pytest.mark.parametrize(
    ("expected", "items", "level", "message"),
    [
        (0, 0, 0, "OK"),
        (2, 1, 2, "Expected 2, found 1"),
        (2, 2, 0, "OK"),
        (2, 0, 3, "No items found, expected 2"),
        (-1, 0, 3, "Stale"),
    ],
)
def test_the_number_of_statuses_is_checked(
    expected: int, items: int, level: int, message: str
) -> None:
    section = Section("/a", "a", 0, expected_number=expected)
    for number in range(items):
        section.analyze(item(str(number), 0))
    head = section.report(0)[0]
    assert (head.level, head.message) == (level, message)
