"""The programs of rostest: hztest, publishtest, paramtest and advertisetest."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree as ET

import pytest
from network import Network

from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import Empty
from rosz.node import Node

_RATE = {"topic": "chatter", "test_duration": 1.0, "wait_time": 30.0}


@pytest.fixture
def robot(network: Network) -> Node:
    """A node with a topic of about 50 Hz, a latched one, a service and a parameter."""
    node = network.node("robot")
    chatter = node.publisher("chatter", String)
    node.timer(0.02, lambda _: chatter.publish(String()))
    node.publisher("once", String, latch=True).publish(String())
    node.service("clear", Empty, lambda _: ())
    node.params.set("/speed", "fast")
    return node


def outcome(network: Network, robot: Node, program: str, parameters: dict[str, Any]) -> list[str]:
    """Run a program, and return the texts of what failed."""
    robot.params.set("/checked", parameters)
    file = network.folder / "results.xml"
    ran = network.run(
        "-m", "rosz", "run", "rostest", program, "__name:=checked", f"--gtest_output=xml:{file}"
    )
    code = ran.exit_code()
    assert file.exists(), ran.output
    failed = [one.text or "" for case in ET.parse(file).getroot() for one in case]
    assert code == bool(failed), ran.output
    return failed


@pytest.mark.system
@pytest.mark.parametrize(
    ("program", "parameters", "failure"),
    [
        ("hztest", {**_RATE, "hz": 50.0, "hzerror": 49.9}, ""),
        ("hztest", {**_RATE, "hz": 5000.0, "hzerror": 1.0}, "is below 4999.000Hz"),
        ("hztest", {**_RATE, "topic": "nothing", "hz": 0.0, "wait_time": 0.1}, ""),
        ("hztest", {"hz": 1.0}, "hztest not initialized properly"),
        ("paramtest", {"param_name_target": "/speed", "param_value_expected": "fast"}, ""),
        ("paramtest", {"param_name_target": "/speed", "param_value_expected": "slow"}, "slow"),
        ("paramtest", {"param_name_target": "/no", "wait_time": 0.1}, "[/no] is not set within"),
        (
            "publishtest",
            {"topics": [{"name": "/once"}, {"name": "/no", "timeout": 0.1, "negative": True}]},
            "",
        ),
        (
            "publishtest",
            {"topics": [{"name": "/once", "negative": True}]},
            "Topic [/once] is published",
        ),
        ("publishtest", {"topics": [{"timeout": 1}]}, "is not valid"),
        (
            "advertisetest",
            {
                "topics": [{"name": "/chatter", "type": "std_msgs/String"}],
                "services": [{"name": "/clear", "type": "std_srvs/Empty"}],
            },
            "",
        ),
        (
            "advertisetest",
            {"topics": [{"name": "/chatter", "type": "std_msgs/Int8"}]},
            "Topic type of [/chatter]",
        ),
    ],
)
def test_programs(
    network: Network, robot: Node, program: str, parameters: dict[str, Any], failure: str
) -> None:
    failed = outcome(network, robot, program, parameters)
    assert len(failed) == bool(failure), failed
    assert all(failure in text for text in failed)
