from __future__ import annotations

import re

import pytest
from network import Network, eventually

from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.std_msgs.msg import Bool, String
from rosz.node import Node

from .shell import Shell, latch, with_log

pytestmark = pytest.mark.usefixtures("talker")


def test_plain_lists_are_sorted(shell: Shell) -> None:
    found = shell("topic", "list").lines
    assert found == ["/cmd_vel", "/robot/pose", "/robot/text", "/rosout"]


def test_a_namespace_limits_the_list(shell: Shell, talker: Node) -> None:
    latch(talker, "/robots", Bool(True))
    assert shell("topic", "list", "/robot").lines == ["/robot/pose", "/robot/text"]
    assert shell("topic", "list", "robot/pose").lines == ["/robot/pose"]
    assert shell("topic", "list", "/nothing").lines == []


def test_sides(shell: Shell) -> None:
    assert shell("topic", "list", "-s").lines == ["/cmd_vel"]
    assert "/cmd_vel" not in shell("topic", "list", "-p").lines


def test_verbose(shell: Shell, network: Network) -> None:
    with_log(network.node("other")).subscription("/cmd_vel", Twist, lambda _: None)
    assert shell("topic", "list", "-v").out == (
        "\nPublished topics:\n"
        " * /robot/pose [geometry_msgs/PoseStamped] 1 publisher\n"
        " * /robot/text [std_msgs/String] 1 publisher\n"
        " * /rosout [rosgraph_msgs/Log] 2 publishers\n"
        "\nSubscribed topics:\n"
        " * /cmd_vel [geometry_msgs/Twist] 2 subscribers\n"
        "\n"
    )
    assert shell("topic", "list", "-v", "-s").out.startswith("\nSubscribed topics:\n")


def test_types(shell: Shell) -> None:
    assert "/robot/text [std_msgs/String]" in shell("topic", "list", "-t").lines


def test_hosts(shell: Shell, talker: Node) -> None:
    first, *rest = shell("topic", "list", "--host").lines
    assert first == f"Host [{talker.process.host}]:"
    assert "  /robot/text" in rest


def test_json(shell: Shell) -> None:
    assert shell("topic", "list", "--json", "/robot/text").json == [
        {
            "name": "/robot/text",
            "types": ["std_msgs/String"],
            "publishers": ["/talker"],
            "subscribers": [],
        }
    ]


def test_both_sides_at_once_is_wrong_usage(shell: Shell) -> None:
    assert shell("topic", "list", "-p", "-s").code == 2


def test_a_node_that_has_just_ended_is_gone(shell: Shell, network: Network) -> None:
    other = network.node("other")
    latch(other, "/other", Bool(True))
    assert "/other" in shell("topic", "list").lines
    other.close()
    eventually(lambda: "/other" not in shell("topic", "list").lines, "the end of a topic")


def test_info(shell: Shell, talker: Node) -> None:
    place = f"{talker.process.host}, pid {talker.process.pid}"
    assert shell("topic", "info", "/robot/text").out == (
        f"Type: std_msgs/String\n\nPublishers: \n * /talker ({place})\n\nSubscribers: None\n\n\n"
    )
    assert "Publishers: None\n" in shell("topic", "info", "cmd_vel").out


def test_info_lists_types_that_differ(shell: Shell, network: Network) -> None:
    network.node("other").subscription("/robot/text", Bool, lambda _: None)
    text = shell("topic", "info", "/robot/text").out
    assert text.startswith("Type: std_msgs/Bool, std_msgs/String\n")
    assert re.search(r" \* /other \(.*\) \[std_msgs/Bool\]\n", text)


def test_info_as_json(shell: Shell, talker: Node) -> None:
    (end,) = shell("topic", "info", "--json", "/robot/text").json["publishers"]
    assert end["node"] == "/talker"
    assert end["pid"] == talker.process.pid
    assert end["hash"] == String._type_hash


def test_info_of_an_unknown_topic_names_the_near_miss(shell: Shell) -> None:
    result = shell("topic", "info", "/robot/tekst")
    assert result.code == 1
    assert result.err == "ERROR: unknown topic '/robot/tekst'; did you mean '/robot/text'?\n"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("/robot/pose", "geometry_msgs/PoseStamped"),
        (
            "/robot/pose/pose/position",
            "geometry_msgs/PoseStamped pose/position geometry_msgs/Point",
        ),
        ("/robot/pose/pose/position/x", "geometry_msgs/PoseStamped pose/position/x float64"),
        ("/robot/pose/header/stamp", "geometry_msgs/PoseStamped header/stamp time"),
        ("robot/text/data", "std_msgs/String data string"),
    ],
)
def test_type(shell: Shell, name: str, text: str) -> None:
    assert shell("topic", "type", name).out == f"{text}\n"


def test_type_of_a_missing_field(shell: Shell) -> None:
    result = shell("topic", "type", "/robot/pose/pose/positon")
    assert result.code == 1
    assert "'/robot/pose' is there, but 'geometry_msgs/Pose' has no field 'positon'" in result.err
    assert "did you mean 'position'?" in result.err


def test_find(shell: Shell) -> None:
    assert shell("topic", "find", "std_msgs/String").lines == ["/robot/text"]
    assert shell("topic", "find", "std_msgs/msg/String").lines == ["/robot/text"]
    assert shell("topic", "find", "std_msgs/Bool").lines == []
