"""What rclpy's nodes do besides messages: events, guard conditions, QoS overrides, log levels."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import UsageError
from rosz.msgs.rcl_interfaces.msg import (
    LoggerLevel,
    ParameterDescriptor,
    ParameterValue,
    SetParametersResult,
)
from rosz.msgs.rcl_interfaces.msg import (
    Parameter as ParameterMessage,
)
from rosz.msgs.rcl_interfaces.srv import (
    DescribeParameters,
    GetLoggerLevels,
    GetParameters,
    SetLoggerLevels,
    SetParameters,
)
from rosz.msgs.std_msgs.msg import Int32, String
from rosz.node import MessageInfo
from rosz.ros2.rclpy import executors, logging, program
from rosz.ros2.rclpy.events import (
    PublisherEventCallbacks,
    SubscriptionEventCallbacks,
    UnsupportedEventTypeError,
)
from rosz.ros2.rclpy.node import Node
from rosz.ros2.rclpy.parameter import Parameter, parameter_dict_from_yaml_file
from rosz.ros2.rclpy.parameter_client import AsyncParameterClient
from rosz.ros2.rclpy.qos import (
    HistoryPolicy,
    InvalidQosOverridesError,
    QoSOverridingOptions,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
)

from .conftest import Start, World


def test_matched_events(world: World) -> None:
    node = world.node
    seen: list[Any] = []
    publisher = node.create_publisher(
        Int32, "n", 10, event_callbacks=PublisherEventCallbacks(matched=seen.append)
    )
    first = node.create_subscription(Int32, "n", print, 10)
    world.spin_until(lambda: seen, "the first subscription")
    second = node.create_subscription(Int32, "n", print, 10)
    world.spin_until(lambda: len(seen) == 2, "the second subscription")
    assert (seen[1].total_count, seen[1].current_count) == (2, 2)
    assert (seen[1].total_count_change, seen[1].current_count_change) == (1, 1)
    node.destroy_subscription(first)
    world.spin_until(lambda: len(seen) == 3, "the end of the first")
    assert (seen[2].total_count, seen[2].total_count_change) == (2, 0)
    assert (seen[2].current_count, seen[2].current_count_change) == (1, -1)
    node.destroy_publisher(publisher)
    node.destroy_subscription(second)


def test_events_of_a_subscription(world: World) -> None:
    node = world.node
    lost: list[Any] = []
    matched: list[Any] = []
    types: list[Any] = []
    callbacks = SubscriptionEventCallbacks(
        message_lost=lost.append, matched=matched.append, incompatible_type=types.append
    )
    subscription = node.create_subscription(Int32, "n", print, 10, event_callbacks=callbacks)
    node.create_publisher(Int32, "n", 10)
    world.spin_until(lambda: matched, "the publisher")
    node.create_publisher(String, "n", 10)
    world.spin_until(lambda: types, "the other type")
    subscription._receive(Int32(6), MessageInfo(0, 0, 6, b"", 4, "std_msgs/msg/Int32"))
    world.spin_until(lambda: lost, "the loss")
    assert (lost[0].total_count, lost[0].total_count_change) == (4, 4)


def test_events_that_the_middleware_lacks(world: World) -> None:
    with pytest.raises(UnsupportedEventTypeError, match="'/n' has no deadline events"):
        world.node.create_publisher(
            Int32, "n", 10, event_callbacks=PublisherEventCallbacks(deadline=print)
        )
    with pytest.raises(UnsupportedEventTypeError, match="no liveliness events"):
        world.node.create_subscription(
            Int32, "n", print, 10, event_callbacks=SubscriptionEventCallbacks(liveliness=print)
        )
    with pytest.raises(TypeError, match="PublisherEventCallbacks has no 'message_lost'"):
        PublisherEventCallbacks(message_lost=print)


def test_guard_conditions(world: World) -> None:
    calls: list[int] = []
    guard = world.node.create_guard_condition(lambda: calls.append(1))
    world.executor.spin_once(timeout_sec=0)
    assert calls == []
    guard.trigger()
    guard.trigger()
    world.executor.spin_once()
    world.executor.spin_once(timeout_sec=0)
    assert calls == [1]
    assert world.node.destroy_guard_condition(guard)
    assert not world.node.destroy_guard_condition(guard)


def test_an_executor_of_a_program(world: World) -> None:
    calls: list[int] = []
    guard = world.node.create_guard_condition(lambda: calls.append(1))
    with pytest.raises(executors.TimeoutException, match="no callback is ready after 0 s"):
        world.executor.wait_for_ready_callbacks(timeout_sec=0)
    guard.trigger()
    handler, group, node = world.executor.wait_for_ready_callbacks()
    assert calls == []
    handler()
    assert (calls, group, node) == ([1], guard.callback_group, world.node)
    world.executor.shutdown()
    with pytest.raises(executors.ShutdownException):
        world.executor.wait_for_ready_callbacks()


def test_a_callback_with_info(world: World) -> None:
    heard: list[Any] = []
    world.node.create_subscription(Int32, "n", lambda *given: heard.append(given), 10)
    world.node.create_subscription(
        Int32, "n", lambda message, info: heard.append((message, info)), 10
    )
    publisher = world.node.create_publisher(Int32, "n", 10)
    eventually(lambda: publisher.get_subscription_count() == 2, "the links")
    publisher.publish(Int32(7))
    world.spin_until(lambda: len(heard) == 2, "both callbacks")
    assert sorted(len(given) for given in heard) == [1, 2]
    message, info = max(heard, key=len)
    assert message.data == 7
    assert 0 < info["source_timestamp"] <= info["received_timestamp"]
    assert info["publication_sequence_number"] == 1


def test_qos_overrides(start: Start) -> None:
    name = "qos_overrides./chatter.publisher"
    world = World(start, "robot", "--ros-args", "-p", f"{name}.reliability:=best_effort",
                  "-p", f"{name}.depth:=3")  # fmt: skip
    seen: list[QoSProfile] = []

    def check(profile: QoSProfile) -> SetParametersResult:
        seen.append(profile)
        return SetParametersResult(successful=profile.depth < 5, reason="too deep")

    options = QoSOverridingOptions.with_default_policies(callback=check)
    publisher = world.node.create_publisher(Int32, "chatter", 7, qos_overriding_options=options)
    assert publisher.qos_profile is seen[0]
    assert (seen[0].depth, seen[0].reliability, seen[0].history) == (
        3,
        ReliabilityPolicy.BEST_EFFORT,
        HistoryPolicy.KEEP_LAST,
    )
    assert world.node.describe_parameter(f"{name}.depth").read_only
    with pytest.raises(InvalidQosOverridesError, match="'/chatter' is refused: too deep"):
        world.node.create_subscription(Int32, "chatter", print, 9, qos_overriding_options=options)


def test_an_override_that_is_no_policy(start: Start) -> None:
    name = "qos_overrides./n.subscription.durability"
    world = World(start, "robot", "--ros-args", "-p", f"{name}:=eternal")
    options = QoSOverridingOptions([QoSPolicyKind.DURABILITY, QoSPolicyKind.LIFESPAN])
    with pytest.raises(InvalidQosOverridesError, match=r"'eternal'; expected one of .*volatile"):
        world.node.create_subscription(Int32, "n", print, 10, qos_overriding_options=options)
    assert not world.node.has_parameter("qos_overrides./n.subscription.lifespan")


class Caller:
    """Another node, whose calls run while a world spins."""

    def __init__(self, world: World, network: Network) -> None:
        self._world = world
        self._network = network
        self._node = network.node("caller")

    def call(self, name: str, kind: Any, *fields: Any) -> Any:
        client = self._node.client(name, kind)
        answers: list[Any] = []

        def ask() -> None:
            client.wait_for_service(TIMEOUT)
            answers.append(client.call(kind.Request(*fields)))

        thread = self._network.thread(ask)
        self._world.spin_until(lambda: answers, f"the response of {name}")
        thread.join(TIMEOUT)
        return answers[0]


def test_levels_by_the_names_of_loggers(start: Start) -> None:
    severity = logging.LoggingSeverity
    logging.set_logger_level("ns/later", severity.ERROR)
    context = start()
    now, later = Node("now", context=context), Node("later", namespace="ns", context=context)
    logging.set_logger_level("now", logging.get_logging_severity_from_string("debug"))
    assert now.get_logger().get_effective_level() is severity.DEBUG
    assert later.get_logger().get_effective_level() is severity.ERROR
    with pytest.raises(KeyError):
        logging.get_logging_severity_from_string("loud")


def test_levels_of_loggers(start: Start, network: Network) -> None:
    world = World(start, "robot", enable_logger_service=True)
    caller = Caller(world, network)
    levels = caller.call("/robot/get_logger_levels", GetLoggerLevels, ["robot", "robot.arm"]).levels
    assert [(level.name, level.level) for level in levels] == [("robot", 0), ("robot.arm", 0)]
    results = caller.call(
        "/robot/set_logger_levels",
        SetLoggerLevels,
        [LoggerLevel("robot.arm", 40), LoggerLevel("other", 10), LoggerLevel("robot", 7)],
    ).results
    assert [result.reason for result in results] == [
        "",
        "node /robot has no logger 'other'",
        "7 is no level; expected 0, 10, 20, 30, 40 or 50",
    ]
    assert not world.node.get_logger().get_child("arm").is_enabled_for(30)
    assert world.node.get_logger().is_enabled_for(30)
    levels = caller.call("/robot/get_logger_levels", GetLoggerLevels, ["robot.arm"]).levels
    assert levels[0].level == 40


def test_parameters_are_set_by_the_node(world: World, network: Network) -> None:
    """The services ask the node, whose callbacks and descriptors may refuse a value."""
    node = world.node
    after: list[Parameter] = []
    node.declare_parameter("speed", 1.0, ParameterDescriptor(description="in m/s"))
    node.declare_parameter("fixed", 1, ParameterDescriptor(read_only=True))
    node.add_on_set_parameters_callback(
        lambda parameters: SetParametersResult(
            successful=all(parameter.value != 9.0 for parameter in parameters), reason="too fast"
        )
    )
    node.add_post_set_parameters_callback(after.extend)
    caller = Caller(world, network)

    def set_to(name: str, **value: Any) -> str:
        parameter = ParameterMessage(name, ParameterValue(**value))
        results = caller.call("/robot/set_parameters", SetParameters, [parameter]).results
        assert results[0].successful == (not results[0].reason)
        return str(results[0].reason)

    assert set_to("speed", type=3, double_value=2.0) == ""
    assert set_to("speed", type=3, double_value=9.0) == "too fast"
    assert "read-only" in set_to("fixed", type=2, integer_value=2)
    assert "expected '3' got '4'" in set_to("speed", type=4, string_value="x")
    assert "undeclared" in set_to("absent", type=2, integer_value=2)
    assert [parameter.value for parameter in after] == [2.0]
    assert network.node("reader").params.get("/robot/speed") == 2.0
    values = caller.call("/robot/get_parameters", GetParameters, ["speed"]).values
    assert values[0].double_value == 2.0
    assert not caller.call("/robot/get_parameters", GetParameters, ["speed", "absent"]).values
    described = caller.call("/robot/describe_parameters", DescribeParameters, ["speed"])
    assert (described.descriptors[0].description, described.descriptors[0].type) == ("in m/s", 3)


def test_a_refused_value_leaves_the_store(world: World, network: Network) -> None:
    node = world.node
    node.declare_parameter("speed", 1.0)
    node.add_on_set_parameters_callback(
        lambda _: SetParametersResult(successful=False, reason="never")
    )
    params = network.node("other").params
    eventually(lambda: params.get("/robot/speed", None) == 1.0, "the first value")
    params.set("/robot/speed", 2.0)
    world.spin_until(lambda: params.get("/robot/speed") == 1.0, "the node's own value")


def test_callbacks_before_a_set(world: World) -> None:
    node = world.node
    node.declare_parameter("a", 1)
    node.declare_parameter("b", 1)

    def both(parameters: list[Parameter]) -> list[Parameter]:
        return [*parameters, Parameter("b", value=parameters[0].value + 1)]

    node.add_pre_set_parameters_callback(both)
    assert node.set_parameters([Parameter("a", value=5)])[0].successful
    assert [parameter.value for parameter in node.get_parameters(["a", "b"])] == [5, 6]
    node.remove_pre_set_parameters_callback(both)
    node.add_pre_set_parameters_callback(lambda _: [])
    assert node.set_parameters([Parameter("a", value=7)])[0].reason == "no parameter is left to set"


def test_a_client_of_parameters(start: Start, tmp_path: Path) -> None:
    server = World(start, "server")
    server.node.declare_parameter("gains.p", 1.0)
    server.node.declare_parameter("name", "x")
    world = World(start, "client")
    stop = threading.Event()

    def serve() -> None:
        while not stop.is_set():
            server.executor.spin_once(timeout_sec=0.05)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        client = AsyncParameterClient(world.node, "/server")
        assert client.wait_for_services(TIMEOUT)
        assert client.services_are_ready()

        def result(future: Any) -> Any:
            world.spin_until(future.done, "the response")
            return future.result()

        names = result(client.list_parameters(["gains"])).result.names
        assert names == ["gains.p"]
        file = tmp_path / "p.yaml"
        file.write_text("/**:\n  ros__parameters: {name: all}\n"
                        "server:\n  ros__parameters: {gains: {p: 2.5}}\n")  # fmt: skip
        done: list[Any] = []
        results = result(
            client.load_parameter_file(str(file), use_wildcard=True, callback=done.append)
        )
        assert all(each.successful for each in results.results)
        assert len(done) == 1
        values = result(client.get_parameters(["gains.p", "name"])).values
        assert (values[0].double_value, values[1].string_value) == (2.5, "all")
        assert result(client.get_parameter_types(["name"])).types == bytes([4])
        atomic = result(client.set_parameters_atomically([Parameter("name", value="y")]))
        assert atomic.result.successful
        assert len(result(client.describe_parameters(["name"])).descriptors) == 1
        refused = result(client.delete_parameters(["name"])).results[0]
        assert not refused.successful or server.node.has_parameter("name")
    finally:
        stop.set()
        thread.join(TIMEOUT)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("[1]", "has no nodes"),
        ("a: 1", "has no 'ros__parameters' below 'a'"),
        ("a: {ros__parameters: {}}", "has no parameters of 'b', only of a"),
    ],
)
def test_files_of_parameters_that_are_wrong(tmp_path: Path, text: str, error: str) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(text)
    with pytest.raises(UsageError, match=error):
        parameter_dict_from_yaml_file(str(file), target_nodes=["b"] if "{}" in text else None)
    with pytest.raises(UsageError, match="cannot read"):
        parameter_dict_from_yaml_file(str(tmp_path / "absent"))


def test_wait_for_message(world: World, network: Network) -> None:
    publisher = network.node("talker").publisher("n", Int32, latch=True)
    publisher.publish(3)
    assert program.wait_for_message(Int32, world.node, "n", time_to_wait=0.0) == (False, None)
    stop = threading.Event()

    def talk() -> None:
        while not stop.wait(0.01):
            publisher.publish(4)

    thread = network.thread(talk)
    try:
        heard, message = program.wait_for_message(Int32, world.node, "n", time_to_wait=TIMEOUT)
        assert (heard, message.data) == (True, 4)
    finally:
        stop.set()
        thread.join(TIMEOUT)
