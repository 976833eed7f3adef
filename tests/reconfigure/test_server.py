from __future__ import annotations

import threading
from functools import partial
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import ParamError, ServiceError
from rosz.msgs.dynamic_reconfigure.msg import (
    BoolParameter,
    ConfigDescription,
    DoubleParameter,
    GroupState,
    IntParameter,
    StrParameter,
)
from rosz.msgs.dynamic_reconfigure.msg import Config as ConfigMessage
from rosz.msgs.dynamic_reconfigure.srv import Reconfigure
from rosz.reconfigure import ALL_LEVELS, Config, Description, Server, Setting

from .robots import ROBOT, Robot

FIRST = {
    "gain": 0.5,
    "steps": 50,
    "label": "hello",
    "enabled": True,
    "size": 0,
    "cutoff": 2.5,
    "taps": 3,
}


def values(config: Config) -> dict[str, Any]:
    return {name: value for name, value in config.items() if name != "groups"}


def test_the_first_call_has_all_levels_and_the_defaults(network: Network) -> None:
    robot = Robot(network.node("robot"))
    ((config, level),) = robot.calls
    assert (level, values(config)) == (ALL_LEVELS, FIRST)
    assert config.gain == config["gain"] == 0.5
    assert config.groups.groups.Filter.state is False
    assert config.groups.groups.Filter.groups.Deep.parameters == {"taps": 3}


def test_values_come_from_the_store_typed_and_clamped(network: Network) -> None:
    node = network.node("robot")
    node.params["~"] = {"gain": 99, "steps": 7.0, "size": "large", "enabled": 0, "other": 1}
    robot = Robot(node)
    config, _ = robot.calls[0]
    assert (config.gain, config.steps, config.size, config.enabled) == (10.0, 7, 2, False)
    assert type(config.gain) is float
    stored = node.params["~"]
    assert stored == FIRST | {"gain": 10.0, "steps": 7, "size": 2, "enabled": False, "other": 1}
    assert type(stored["gain"]) is float
    assert type(stored["enabled"]) is bool


def test_a_stored_value_of_no_use_is_named_and_left_out(
    network: Network, capfd: pytest.CaptureFixture[str]
) -> None:
    node = network.node("robot")
    node.params["~gain"] = [1, 2]
    assert Robot(node).calls[0][0].gain == 0.5
    node.log.flush()
    said = capfd.readouterr().err
    assert "ignoring parameter '/robot/gain', set by /robot" in said
    assert "'gain' cannot be [1, 2]: expected a number" in said


@pytest.mark.parametrize(
    ("changes", "level", "expected"),
    [
        ({"gain": 2}, 1, {"gain": 2.0}),
        ({"gain": -5.0}, 1, {"gain": 0.0}),
        ({"gain": "1e3", "steps": "0x10"}, 3, {"gain": 10.0, "steps": 16}),
        ({"steps": 50}, 0, {}),
        ({"steps": 1000}, 2, {"steps": 100}),
        ({"label": "x", "enabled": "off"}, 12, {"label": "x", "enabled": False}),
        ({"size": "LARGE"}, 16, {"size": 2}),
        ({"taps": 4, "cutoff": 1}, 96, {"taps": 4, "cutoff": 1.0}),
        ({}, 0, {}),
    ],
)
def test_update(
    network: Network, changes: dict[str, Any], level: int, expected: dict[str, Any]
) -> None:
    robot = Robot(network.node("robot"))
    assert values(robot.server.update(changes)) == FIRST | expected
    assert robot.levels == [ALL_LEVELS, level]
    assert robot.server.node.params["~"] == FIRST | expected


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"gian": 1}, "there is no setting 'gian'; did you mean 'gain'?"),
        ({"gain": "much"}, "'gain' cannot be 'much': expected a number"),
        ({"gain": None}, "'gain' cannot be None: expected a number"),
        (
            {"size": "huge"},
            "'size' cannot be 'huge': expected a whole number or one of Small, Large",
        ),
        ({"enabled": "maybe"}, "'enabled' cannot be 'maybe': expected true or false"),
        ({"steps": float("nan")}, "'steps' cannot be nan: expected a whole number"),
        ({"steps": 1 << 40}, "'steps' cannot be 1099511627776: expected -2147483648 to 2147483647"),
        ({"label": [1]}, "'label' cannot be [1]: expected a text"),
        ({"groups": {"Filtre": True}}, "there is no group 'Filtre'; did you mean 'Filter'?"),
        ({"groups": 1}, "'groups' is 1; expected a dictionary"),
    ],
)
def test_a_wrong_change_changes_nothing(
    network: Network, changes: dict[str, Any], text: str
) -> None:
    robot = Robot(network.node("robot"))
    with pytest.raises(ParamError) as caught:
        robot.server.update({"steps": 3} | changes)
    assert str(caught.value).startswith(text)
    assert values(robot.server.config) == FIRST
    assert robot.levels == [ALL_LEVELS]


def test_what_the_callback_decides_holds(network: Network) -> None:
    robot = Robot(network.node("robot"))
    robot.answer = {"steps": 42.0, "gain": 11}
    config = robot.server.update({"steps": 7})
    assert (config.steps, config.gain) == (42, 11.0)
    assert robot.server.node.params["~steps"] == 42


def test_a_callback_may_refuse(network: Network) -> None:
    def decide(config: Config, level: int) -> None:
        if level != ALL_LEVELS:
            raise ValueError(f"not {config.gain}")

    server = Server(network.node("robot"), ROBOT, decide)
    with pytest.raises(ValueError, match=r"not 3\.0"):
        server.update({"gain": 3})
    assert server.config.gain == server.node.params["~gain"] == 0.5


def test_a_callback_that_returns_nonsense(network: Network) -> None:
    server = Server(network.node("robot"), ROBOT)
    server.callback = lambda _config, _level: {"gain": "nonsense"}
    with pytest.raises(ParamError, match="'gain' cannot be 'nonsense'"):
        server.update({"gain": 3})
    assert server.config.gain == 0.5


def test_a_callback_may_change_settings_itself(network: Network) -> None:
    def decide(_config: Config, level: int) -> None:
        if level == 1:
            server.update({"steps": 9})

    server = Server(network.node("robot"), ROBOT, decide)
    assert server.update({"gain": 1}).gain == 1


def test_states_of_groups(network: Network) -> None:
    robot = Robot(network.node("robot"))
    config = robot.server.update({"groups": {"Filter": True, "Deep": False}})
    assert config.groups.groups.Filter.state is True
    assert config.groups.groups.Filter.groups.Deep.state is False
    assert config.groups.groups.Other.state is True
    assert robot.levels[-1] == 0
    config.groups.groups.Other.state = False
    assert robot.server.update(config).groups.groups.Other.state is False


def test_topics_and_service_of_ros1(network: Network) -> None:
    robot = Robot(network.node("robot"))
    node = network.node("other")
    description = node.subscription("/robot/parameter_descriptions", ConfigDescription).get()
    assert [group.name for group in description.groups] == ["Default", "Filter", "Deep", "Other"]
    assert [(group.id, group.parent) for group in description.groups] == [
        (0, 0), (1, 0), (2, 1), (3, 0),
    ]  # fmt: skip
    assert [one.name for one in description.groups[0].parameters] == list(FIRST)[:5]
    assert description.groups[0].parameters[0].level == 1
    assert description.max.doubles[0] == DoubleParameter("gain", 10.0)
    assert description.min.ints[2] == IntParameter("taps", -(1 << 31))
    assert description.dflt.strs == [StrParameter("label", "hello")]
    updates = node.subscription("/robot/parameter_updates", ConfigMessage)
    first = updates.get()
    assert first.bools == [BoolParameter("enabled", True)]
    assert [state.name for state in first.groups] == ["Default", "Deep", "Filter", "Other"]
    service = node.client("/robot/set_parameters", Reconfigure)
    service.wait_for_service()
    request = ConfigMessage(
        ints=[IntParameter("gain", 3), IntParameter("steps", 101)],
        groups=[GroupState("Filter", True, 1, 0), GroupState("None", True, 77, 0)],
    )
    answer = service(request).config
    assert answer == updates.get()
    assert {one.name: one.value for one in answer.doubles} == {"gain": 3.0, "cutoff": 2.5}
    assert answer.groups[2] == GroupState("Filter", True, 1, 0)
    assert robot.levels == [ALL_LEVELS, 3]


def test_the_service_says_why_it_refuses(network: Network) -> None:
    Robot(network.node("robot"))
    service = network.node("other").client("/robot/set_parameters", Reconfigure)
    service.wait_for_service()
    with pytest.raises(ServiceError, match="there is no setting 'gian'; did you mean 'gain'"):
        service(ConfigMessage(doubles=[DoubleParameter("gian", 1.0)]))


@pytest.mark.parametrize(
    ("namespace", "name"),
    [
        ("", "/ns/robot"),
        ("left", "/ns/robot/left"),
        ("left/arm/", "/ns/robot/left/arm"),
        ("~left", "/ns/robot/left"),
        ("/left", "/left"),
    ],
)
def test_namespaces(network: Network, namespace: str, name: str) -> None:
    node = network.node("robot", namespace="/ns")
    robot = Robot(node, namespace)
    assert robot.server.name == name
    assert node.params[f"{name}/steps"] == 50
    node.context.graph.wait_for_service(name + "/set_parameters", TIMEOUT)


def test_two_servers_on_one_node(network: Network) -> None:
    node = network.node("robot")
    left, right = Robot(node, "left"), Robot(node, "right")
    left.server.update({"steps": 1})
    right.server.update({"steps": 2})
    assert (node.params["~left/steps"], node.params["~right/steps"]) == (1, 2)


def test_a_restarted_server_goes_on_with_its_values(network: Network) -> None:
    keeper = network.node("keeper")
    assert keeper.params.names() is not None
    node = network.node("robot")
    Robot(node).server.update({"gain": 7, "size": "Large"})
    node.close()
    again = Robot(network.node("robot")).calls[0][0]
    assert (again.gain, again.size) == (7.0, 2)


def test_private_parameters_of_the_command_line(network: Network) -> None:
    node = network.node("robot", argv=["_gain:=3", "_label:=5"])
    config = Robot(node).calls[0][0]
    assert (config.gain, config.label) == (3.0, "5")


def test_the_store_is_not_followed_unless_asked(network: Network) -> None:
    node = network.node("robot")
    quiet, following = Robot(node, "quiet"), Robot(node, "following", follow=True)
    other = network.node("other")
    other.params.update({"/robot/quiet/steps": 5, "/robot/following/steps": 500})
    eventually(lambda: following.server.config.steps == 100, "the store is followed")
    eventually(lambda: other.params["/robot/following/steps"] == 100, "the clamped value is stored")
    assert quiet.server.config.steps == 50
    assert following.levels == [ALL_LEVELS, 2]


def test_changes_come_one_at_a_time(network: Network) -> None:
    inside = 0
    most = 0

    def decide(_config: Config, _level: int) -> None:
        nonlocal inside, most
        inside += 1
        most = max(most, inside)
        threading.Event().wait(0.01)
        inside -= 1

    server = Server(network.node("robot"), Description([Setting("n", 0)]), decide)
    threads = [network.thread(partial(server.update, {"n": number})) for number in range(8)]
    for thread in threads:
        thread.join()
    assert most == 1


def test_closing_withdraws_the_server(network: Network) -> None:
    node = network.node("robot")
    robot = Robot(node)
    robot.server.close()
    robot.server.close()
    name, graph = "/robot/set_parameters", node.context.graph
    graph.wait_for(lambda view: name not in view.services(), TIMEOUT, "the end of the service")
    Robot(node)
    graph.wait_for_service(name, TIMEOUT)
