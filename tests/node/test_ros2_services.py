"""The services that every ROS 2 node has, over rosz's parameters; as rclcpp's do."""

from __future__ import annotations

import datetime as dt
import threading
import time
from array import array
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import ParamError
from rosz.lifecycle import Registration
from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.rcl_interfaces.msg import (
    Parameter,
    ParameterEvent,
    ParameterType,
    ParameterValue,
)
from rosz.msgs.rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rosz.msgs.std_srvs.srv import SetBool
from rosz.msgs.type_description_interfaces.srv import GetTypeDescription
from rosz.node import Client, Node
from rosz.node.ros2 import detector, parameters, remote
from rosz.node.ros2.events import ParameterEvents
from rosz.node.ros2.values import from_ros2, to_ros2
from rosz.params import DELETED
from rosz.params.replica import Changed
from rosz.qos import PARAMETERS
from rosz.wire import Kind, Token, format_token

STORED = {
    "rate": 10.0,
    "gains": {"p": 1, "inner": {"deep": True}, "names": ["x", "y"]},
    "odd": [1, "a"],
    "day": dt.date(2025, 5, 31),
    "nothing": {},
}
NAMES = ["day", "gains.inner.deep", "gains.names", "gains.p", "odd", "rate", "use_sim_time"]


@pytest.fixture
def talker(network: Network) -> Node:
    node = network.node("talker", namespace="robot")
    node.params["~"] = STORED
    return node


@pytest.fixture
def asker(network: Network, talker: Node) -> Node:  # noqa: ARG001  # there before it
    return network.node("asker")


def client(asker: Node, name: str, kind: type[Any]) -> Client:
    made = asker.client(f"/robot/talker/{name}", kind, timeout=TIMEOUT)
    made.wait_for_service(TIMEOUT)
    return made


def number(name: str, value: int) -> Parameter:
    return Parameter(name, ParameterValue(ParameterType.PARAMETER_INTEGER, integer_value=value))


@pytest.mark.parametrize(
    ("value", "kind", "field"),
    [
        (True, 1, "bool_value"),
        (-(1 << 63), 2, "integer_value"),
        (0.25, 3, "double_value"),
        ("é\n", 4, "string_value"),
        (b"\x00\xff", 5, "byte_array_value"),
        ([True, False], 6, "bool_array_value"),
        ([1, -2], 7, "integer_array_value"),
        ([1.5, 2.5], 8, "double_array_value"),
        (["a", ""], 9, "string_array_value"),
    ],
)
def test_values_both_ways(value: object, kind: int, field: str) -> None:
    sent = to_ros2(value)
    assert (sent.type, getattr(sent, field)) == (kind, value)
    decoded = ParameterValue._decode(ParameterValue._encode(sent))
    back = from_ros2(decoded)
    assert back == value
    assert type(back) is type(value)


@pytest.mark.parametrize(
    ("value", "kind", "field", "shown"),
    [
        ([1, 2.5], 8, "double_array_value", [1, 2.5]),
        ([], 5, "byte_array_value", b""),
        ([1, "a"], 4, "string_value", "[1, a]"),
        ([True, 1], 4, "string_value", "[true, 1]"),
        ([[1], [2]], 4, "string_value", "[[1], [2]]"),
        (dt.date(2025, 5, 31), 4, "string_value", "2025-05-31"),
    ],
)
def test_values_that_only_the_store_has(
    value: object, kind: int, field: str, shown: object
) -> None:
    sent = to_ros2(value)
    assert (sent.type, getattr(sent, field)) == (kind, shown)


def test_value_of_no_type() -> None:
    with pytest.raises(ParamError, match="'10' is not a type of parameter; expected 0 to 9"):
        from_ros2(ParameterValue(10))


@pytest.mark.parametrize(
    ("prefixes", "depth", "names", "above"),
    [
        ([], 0, NAMES, ["gains", "gains.inner"]),
        ([], 1, ["day", "odd", "rate", "use_sim_time"], []),
        ([], 2, [n for n in NAMES if n != "gains.inner.deep"], ["gains"]),
        (["gains"], 0, NAMES[1:4], ["gains", "gains.inner"]),
        (["gains"], 1, NAMES[2:4], ["gains"]),
        (["gains.p", "rate"], 1, ["gains.p", "rate"], ["gains"]),
        (["gain"], 0, [], []),
        (["gains."], 0, [], []),
    ],
)
def test_list(
    asker: Node, prefixes: list[str], depth: int, names: list[str], above: list[str]
) -> None:
    result = client(asker, "list_parameters", ListParameters)(prefixes, depth).result
    assert (result.names, result.prefixes) == (names, above)


def test_get(asker: Node) -> None:
    values = client(asker, "get_parameters", GetParameters)(["rate", "none", "gains.p"]).values
    assert [value.type for value in values] == [3, 0, 2]
    assert (values[0].double_value, values[2].integer_value) == (10.0, 1)
    types = client(asker, "get_parameter_types", GetParameterTypes)
    assert types([*NAMES, "none", "gains"]).types == bytes([4, 1, 9, 2, 4, 3, 1, 0, 0])


def test_describe(asker: Node) -> None:
    ask = client(asker, "describe_parameters", DescribeParameters)
    rate, odd, sim, none = ask(["rate", "odd", "use_sim_time", "none"]).descriptors
    assert (rate.name, rate.type, rate.read_only, rate.dynamic_typing) == ("rate", 3, False, True)
    assert (odd.type, odd.read_only) == (4, True)
    assert odd.additional_constraints == "YAML of a list, which ROS 2 has no type for"
    assert (sim.type, sim.read_only) == (1, False)
    assert (none.name, none.type) == ("none", 0)


def test_set(asker: Node, talker: Node) -> None:
    """One by one: those that cannot be set do not hold the others up."""
    seen: list[Any] = []
    talker.params.watch("~rate", seen.append)
    set_parameters = client(asker, "set_parameters", SetParameters)
    results = set_parameters(
        [
            number("rate", 5),
            number("new.x", 1),
            number("gains", 1),
            number("odd", 1),
            number("use_sim_time", 1),
            number("", 1),
            Parameter("gains.p"),
            Parameter("none"),
            Parameter("rate", ParameterValue(77)),
        ]
    ).results
    assert [result.successful for result in results] == [
        True,
        True,
        False,
        False,
        False,
        False,
        True,
        False,
        False,
    ]
    assert [result.reason for result in results if not result.successful] == [
        "'gains' is not a parameter: there are parameters below it",
        "'odd' is a list that ROS 2 has no type for: set '/robot/talker/odd' with 'rosz param set'",
        "'use_sim_time' cannot be the int 1; expected bool",
        "'' is not the name of a parameter",
        "'none' is not set",
        "'77' is not a type of parameter; expected 0 to 9",
    ]
    assert talker.params["~rate"] == 5
    assert talker.params["~new/x"] == 1
    assert "~gains/p" not in talker.params
    assert "for ROS 2" in talker.params.origin("~rate")
    eventually(lambda: [change.new for change in seen] == [5], "the watch is told")


def test_set_atomically(asker: Node, talker: Node) -> None:
    """All or nothing, and as one change."""
    put = client(asker, "set_parameters_atomically", SetParametersAtomically)
    refused = put([number("rate", 6), Parameter("none")]).result
    assert (refused.successful, refused.reason) == (False, "'none' is not set")
    assert talker.params["~rate"] == 10.0
    assert put([number("rate", 6), Parameter("gains.p"), number("a", 1)]).result.successful
    assert talker.params["~rate"] == 6
    assert talker.params["~a"] == 1
    assert "~gains/p" not in talker.params


def test_simulated_time_is_set_while_the_node_runs(asker: Node, talker: Node) -> None:
    put = client(asker, "set_parameters", SetParameters)

    def switch(value: ParameterValue) -> bool:
        (result,) = put([Parameter("use_sim_time", value)]).results
        assert result.successful
        return talker.clock.simulated

    assert switch(to_ros2(True)) is True
    assert switch(to_ros2(False)) is False
    assert switch(to_ros2(True)) is True
    assert switch(ParameterValue()) is False
    assert not asker.clock.simulated


def test_arrays_arrive_as_lists(asker: Node, talker: Node) -> None:
    value = ParameterValue(ParameterType.PARAMETER_DOUBLE_ARRAY, double_array_value=[1, 2])
    assert isinstance(
        ParameterValue._decode(ParameterValue._encode(value)).double_array_value, array
    )
    put = client(asker, "set_parameters", SetParameters)
    assert put([Parameter("list", value)]).results[0].successful
    assert talker.params["~list"] == [1.0, 2.0]
    assert type(talker.params["~list"]) is list


def test_a_node_without_parameters(network: Network) -> None:
    bare, asker = network.node("bare"), network.node("asker")
    ask = asker.client("/bare/list_parameters", ListParameters)
    ask.wait_for_service(TIMEOUT)
    assert ask().result.names == ["use_sim_time"]
    bare.params["/bare"] = 3  # a leaf where a namespace is usual
    assert ask().result.names == ["use_sim_time"]


def test_type_description(asker: Node) -> None:
    ask = client(asker, "get_type_description", GetTypeDescription)
    found = ask("geometry_msgs/msg/Twist", Twist._type_hash)
    assert found.successful
    top = found.type_description.type_description
    assert [(f.name, f.type.type_id, f.type.nested_type_name) for f in top.fields] == [
        ("linear", 1, "geometry_msgs/msg/Vector3"),
        ("angular", 1, "geometry_msgs/msg/Vector3"),
    ]
    (vector,) = found.type_description.referenced_type_descriptions
    assert [(f.name, f.type.type_id) for f in vector.fields] == [("x", 11), ("y", 11), ("z", 11)]
    assert [s.encoding for s in found.type_sources] == ["msg", "msg"]
    assert "float64 x" in found.type_sources[1].raw_file_contents


def test_type_description_of_a_service(asker: Node) -> None:
    ask = client(asker, "get_type_description", GetTypeDescription)
    found = ask("std_srvs/srv/SetBool", SetBool._type_hash)
    assert found.successful
    names = [f.name for f in found.type_description.type_description.fields]
    assert names == ["request_message", "response_message", "event_message"]
    sources = {s.type_name: s.encoding for s in found.type_sources}
    assert sources["std_srvs/srv/SetBool"] == "srv"
    assert sources["std_srvs/srv/SetBool_Event"] == "implicit"


@pytest.mark.parametrize(
    ("name", "type_hash", "reason"),
    [
        ("nothing/msg/X", "", "there is no package 'nothing'"),
        ("x", "", "'x' is not a type; expected the form 'pkg/msg/Name' or 'pkg/srv/Name'"),
        ("std_msgs/String", "", "'std_msgs/String' is not a type"),
        ("std_msgs/msg/String", "RIHS01_0", "the version of 'std_msgs/msg/String' here has the"),
    ],
)
def test_type_that_is_not_known(asker: Node, name: str, type_hash: str, reason: str) -> None:
    answer = client(asker, "get_type_description", GetTypeDescription)(name, type_hash, False)
    assert not answer.successful
    assert reason in answer.failure_reason
    assert answer.type_sources == []


def test_nobody_asks_no_services(network: Network, talker: Node) -> None:
    """Among nodes of rosz alone nothing is declared, as long as no client wants it."""
    other = network.node("other")
    other.context.graph.wait_for_node("/robot/talker", TIMEOUT)
    other.client("/other/something/else", SetBool)
    graph = talker.context.graph
    graph.wait_for(lambda view: bool(view.clients("/other/something/else")), TIMEOUT, "a client")
    assert graph.view().services() == {}


def test_a_foreign_node_brings_them(network: Network, talker: Node) -> None:
    """Who looks at the list of services before calling, as ``ros2 param`` does, finds them."""
    token = Token(network.domain, "abc", 0, 0, Kind.NODE, "/", "_ros2cli_1")
    kept = network.session().token(format_token(token))
    view = talker.context.graph.wait_for_service("/robot/talker/set_parameters", TIMEOUT)
    talker.context.graph.wait_for_service("/robot/talker/get_type_description", TIMEOUT)
    (server,) = view.servers("/robot/talker/set_parameters")
    assert server.qos is not None
    assert server.qos.depth == 1000
    kept.close()


def test_humble_has_no_type_descriptions(network: Network) -> None:
    context = network.context(distro="humble")
    node = network.node("old", context=context)
    node.client("old/list_parameters", ListParameters).wait_for_service(TIMEOUT)
    assert "/old/get_type_description" not in node.context.graph.view().services()


def test_a_node_that_starts_beside_ros2(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is there may be found, and the services declared, before the detector is made."""
    tried = threading.Event()

    def start(thread: threading.Thread) -> None:
        thread.start()
        thread.join(0.5)  # long enough to fail, or to wait for the registration
        tried.set()

    def register(unregister: Callable[[], object]) -> Registration:
        assert tried.wait(TIMEOUT)
        return Registration(unregister)

    node = Token(network.domain, "abc", 0, 0, Kind.NODE, "/", "of_ros2")
    kept = network.session().token(format_token(node))
    monkeypatch.setattr(detector, "start_thread", start)
    monkeypatch.setattr(detector, "Registration", register)
    graph = network.node("late").context.graph
    graph.wait_for_service("/late/get_parameters", TIMEOUT)
    kept.close()


def test_a_client_that_sees_the_first_service_calls_another(
    asker: Node, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A busy node takes its time from one service to the next."""
    go_on = threading.Event()
    register = parameters._SharedService._open

    def wait(service: parameters._SharedService, threads: int) -> None:
        if service.name.endswith("/set_parameters"):
            assert go_on.wait(TIMEOUT)
        register(service, threads)

    monkeypatch.setattr(parameters._SharedService, "_open", wait)
    monkeypatch.setattr(remote, "_ATTEMPTS", 1)
    first = client(asker, "list_parameters", ListParameters)
    (server,) = first.others.view().servers(first.name)
    request = remote.RemoteParameters(asker.context.session, server, TIMEOUT)
    response = request.begin("set_parameters", [number("rate", 3)])
    release = threading.Timer(0.2, go_on.set)  # by then, who has it would have refused it
    release.start()
    assert response().results[0].successful
    release.join()


def test_they_end_with_the_node(talker: Node, asker: Node) -> None:
    client(asker, "get_parameters", GetParameters)
    talker.close()
    asker.context.graph.wait_for(lambda view: not view.services(), TIMEOUT, "no more services")


EVENTS = "/parameter_events"


def subscribe_events(node: Node) -> SimpleQueue[ParameterEvent]:
    events: SimpleQueue[ParameterEvent] = SimpleQueue()
    node.subscription(EVENTS, ParameterEvent, events.put)
    return events


def values_of(parameters: list[Parameter]) -> dict[str, object]:
    return {row.name: from_ros2(row.value) for row in parameters}


def next_event(events: SimpleQueue[ParameterEvent], node: str) -> list[dict[str, object]]:
    """Return what is new, changed and deleted in the next event of a node."""
    while (event := events.get(timeout=TIMEOUT)).node != node:
        pass
    assert abs(event.stamp.sec - time.time()) < TIMEOUT
    groups = event.new_parameters, event.changed_parameters, event.deleted_parameters
    return list(map(values_of, groups))


def test_events_of_calls(asker: Node, talker: Node) -> None:
    """One event for each call, with what rclpy's has, from a publisher like that of rclpy."""
    events = subscribe_events(asker)
    view = asker.context.graph.wait_for(
        lambda view: len(view.publishers(EVENTS)) == 2, TIMEOUT, "the publishers"
    )
    names = {token.node_name: token for token in view.publishers(EVENTS)}
    publisher = names["/robot/talker"]
    assert publisher.type_name == "rcl_interfaces/msg/ParameterEvent"
    assert publisher.qos == PARAMETERS
    talker.params["~rate"] = 10.0  # it is that already
    put = client(asker, "set_parameters_atomically", SetParametersAtomically)
    assert put([number("rate", 6), Parameter("gains.p"), number("a", 1)]).result.successful
    assert next_event(events, "/robot/talker") == [{"a": 1}, {"rate": 6}, {"gains.p": DELETED}]
    put = client(asker, "set_parameters", SetParameters)
    assert all(each.successful for each in put([number("a", 2), number("b", 3)]).results)
    assert next_event(events, "/robot/talker") == [{}, {"a": 2}, {}]
    assert next_event(events, "/robot/talker") == [{"b": 3}, {}, {}]


def test_a_busy_process_has_one_event_for_each_call(
    asker: Node, talker: Node, monkeypatch: pytest.MonkeyPatch
) -> None:
    note = ParameterEvents._changed

    def note_late(events: ParameterEvents, change: Changed) -> None:
        time.sleep(0.02)  # other threads run for so long
        note(events, change)

    monkeypatch.setattr(ParameterEvents, "_changed", note_late)
    events = subscribe_events(asker)
    asker.context.graph.wait_for(
        lambda view: len(view.publishers(EVENTS)) == 2, TIMEOUT, "the publishers"
    )
    talker.params.update({"~a": 1, "~b": 2, "~c": 3})
    assert next_event(events, "/robot/talker") == [{"a": 1, "b": 2, "c": 3}, {}, {}]


def test_events_of_the_store(asker: Node, talker: Node) -> None:
    """However a parameter is set: with types that are other ones, in a subtree, from elsewhere."""
    events = subscribe_events(asker)
    asker.context.graph.wait_for(
        lambda view: len(view.publishers(EVENTS)) == 2, TIMEOUT, "the publishers"
    )
    talker.params["~rate"] = 10
    assert next_event(events, "/robot/talker") == [{}, {"rate": 10}, {}]
    asker.params["/robot/talker/gains"] = {"p": 1, "q": "new"}
    assert next_event(events, "/robot/talker") == [
        {"gains.q": "new"},
        {},
        {"gains.inner.deep": DELETED, "gains.names": DELETED},
    ]
    del talker.params["/robot"]
    gone = {"rate", "gains.p", "gains.q", "odd", "day"}
    assert next_event(events, "/robot/talker") == [{}, {}, dict.fromkeys(gone, DELETED)]


def test_who_was_there_hears_of_the_first_parameters(network: Network) -> None:
    asker = network.node("asker")
    asker.params["/late"] = {"rate": 5, "gains": {"p": 0.5}}
    events = subscribe_events(asker)
    context = network.context()
    assert context.mesh.linked.wait(TIMEOUT)  # else who was there seems to come later
    network.node("late", context=context)
    assert next_event(events, "/late") == [
        {"use_sim_time": False, "rate": 5, "gains.p": 0.5},
        {},
        {},
    ]


def test_nobody_wants_events(network: Network, talker: Node) -> None:
    """Without a node of ROS 2 or a subscription of them, nobody publishes any."""
    other = network.node("other")
    talker.params["~rate"] = 1
    other.subscription("/robot/parameter_events", ParameterEvent)
    graph = talker.context.graph
    graph.wait_for_subscribers("/robot/parameter_events", 1, TIMEOUT)
    assert graph.view().publishers(EVENTS) == []
    kept = network.session().token(
        format_token(Token(network.domain, "abc", 0, 0, Kind.NODE, "/", "_ros2cli_1"))
    )
    graph.wait_for(lambda view: len(view.publishers(EVENTS)) == 2, TIMEOUT, "the publishers")
    kept.close()
