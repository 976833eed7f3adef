"""Parameters in both directions, by the services of ROS 2, and the events of their changes."""

from __future__ import annotations

import json
from typing import Any

import pytest
from cli.shell import Shell
from network import TIMEOUT, eventually

from rosz.msgs.rcl_interfaces.msg import Parameter, ParameterEvent, ParameterType, ParameterValue
from rosz.msgs.rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rosz.node import Node

from .city import City, Peer

SERVICES = (
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
)
EVENT = "rcl_interfaces/msg/ParameterEvent"
DECLARED: dict[str, Any] = {
    "speed": 5,
    "gain": 0.5,
    "frame": "mäp",
    "on": True,
    "names": ["a", "b"],
    "powers": [1, 2, 4],
}


@pytest.fixture
def node(city: City) -> Node:
    """A node with parameters, as the other one has them, too."""
    made = city.node("robot")
    made.params["~"] = DECLARED
    return made


def test_its_client(node: Node, peer: Peer) -> None:
    """All six services of a node of rosz, called by hiroz."""
    peer.do("listen", EVENT, "/parameter_events", "keepall")
    node.context.graph.wait_for_subscribers("/parameter_events", 1, TIMEOUT)
    for service in SERVICES:  # its calls do not wait for a server
        peer.wait_for_service(f"/robot/{service}")

    def ask(verb: str, given: object) -> Any:
        text = json.dumps(given, ensure_ascii=False, separators=(",", ":"))
        return peer.ask("parameters /robot", "parameters", "/robot", verb, text)

    assert ask("get", [*DECLARED]) == [*DECLARED.values()]
    assert ask("get", ["nothing"]) in ([], [None])
    assert ask("types", ["speed", "gain", "names"]) == [2, 3, 9]
    assert {*ask("list", [])} == {*DECLARED, "use_sim_time"}
    assert ask("describe", ["speed"]) == [["speed", 2, False]]
    assert ask("set", {"speed": 7}) == [[True, ""]]
    assert ask("set_atomically", {"gain": 0.25, "new": [1.5, 2.5]}) == [True, ""]
    assert node.params["~speed"] == 7
    assert node.params["~new"] == [1.5, 2.5]
    seen: dict[str, float] = {}
    while seen != {"speed": 7, "gain": 0.25}:
        event = peer.next("heard /parameter_events")
        if event["node"] == "/robot":
            for row in event["changed_parameters"]:
                value = row["value"]
                integer = value["type"] == ParameterType.PARAMETER_INTEGER
                seen[row["name"]] = value["integer_value" if integer else "double_value"]


def test_its_services(node: Node, peer: Peer) -> None:
    """All six services of a node of hiroz."""
    for name, value in DECLARED.items():
        text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
        peer.do("declare", name, text)
    events = node.subscription("/parameter_events", ParameterEvent)

    def ask(kind: type[Any], *arguments: Any) -> Any:
        name = "".join(
            f"_{letter.lower()}" if letter.isupper() else letter for letter in kind.__name__
        )
        with node.client(f"/partner/{name[1:]}", kind, timeout=TIMEOUT) as client:
            client.wait_for_service(TIMEOUT)
            return client(*arguments)

    values = ask(GetParameters, [*DECLARED]).values
    assert values[0].integer_value == 5
    assert values[2].string_value == "mäp"
    assert [*values[5].integer_array_value] == [1, 2, 4]
    assert [*ask(GetParameterTypes, ["speed", "gain", "on"]).types] == [2, 3, 1]
    assert {*DECLARED} <= {*ask(ListParameters, [], 0).result.names}
    (described,) = ask(DescribeParameters, ["speed"]).descriptors
    assert (described.name, described.type) == ("speed", 2)

    def speed(number: int) -> list[Parameter]:
        value = ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=number)
        return [Parameter("speed", value)]

    (result,) = ask(SetParameters, speed(7)).results
    assert result.successful
    result = ask(SetParametersAtomically, speed(100)).result
    assert (result.successful, result.reason) == (False, "it is too large")
    assert peer.ask("value speed", "get", "speed") == 7
    while not (event := events.get(TIMEOUT)).changed_parameters:
        pass
    assert event.node == "/partner"
    assert event.changed_parameters[0].value.integer_value == 7


def test_commands(peer: Peer, shell: Shell) -> None:
    """``ros2 param`` of rosz, with a node of hiroz."""
    peer.do("declare", "speed", 5)
    eventually(lambda: "/partner" in shell("node", "list").out, "the node of hiroz")
    assert "  speed" in shell("ros2", "param", "list", "/partner").lines
    assert shell("ros2", "param", "get", "/partner", "speed").lines == ["Integer value is: 5"]
    assert shell("ros2", "param", "set", "/partner", "speed", "7").code == 0
    assert peer.ask("value speed", "get", "speed") == 7
    refused = shell("ros2", "param", "set", "/partner", "speed", "100")
    assert "it is too large" in refused.out + refused.err
    assert "    speed: 7" in shell("ros2", "param", "dump", "/partner").lines
