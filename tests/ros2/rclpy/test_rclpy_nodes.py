"""Nodes of rclpy: their callbacks, services and parameters, in this process."""

from __future__ import annotations

import asyncio
import threading
from contextlib import suppress
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import ClosedError, ServiceError
from rosz.msgs.builtin_interfaces.msg import Time as TimeMessage
from rosz.msgs.rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rosz.msgs.rcl_interfaces.srv import SetParameters
from rosz.msgs.rosgraph_msgs.msg import Clock as ClockMessage
from rosz.msgs.std_msgs.msg import Int32, String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.ros2.rclpy import exceptions, executors
from rosz.ros2.rclpy.context import Context
from rosz.ros2.rclpy.executors import (
    Future,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from rosz.ros2.rclpy.node import Node
from rosz.ros2.rclpy.parameter import Parameter
from rosz.ros2.rclpy.qos import DurabilityPolicy, QoSProfile
from rosz.ros2.rclpy.time import ClockChange, ClockType, Duration, JumpThreshold, TimeJump

from .conftest import Start, World


def test_messages_are_handled_while_spinning_and_on_its_thread(world: World) -> None:
    heard: list[tuple[int, threading.Thread]] = []
    node = world.node
    subscription = node.create_subscription(
        Int32, "n", lambda m: heard.append((m.data, threading.current_thread())), 10
    )
    publisher = node.create_publisher(Int32, "n", 10)
    eventually(lambda: publisher.get_subscription_count() == 1, "the link")
    for number in range(3):
        publisher.publish(Int32(data=number))
    eventually(lambda: len(subscription._queue) == 3, "the messages")
    assert heard == []
    for count in (1, 2, 3):
        world.executor.spin_once()
        assert len(heard) == count
    assert heard == [(n, threading.current_thread()) for n in range(3)]
    assert (publisher.topic_name, subscription.topic_name) == ("/n", "/n")
    eventually(lambda: subscription.get_publisher_count() == 1, "the publisher")
    assert node.count_publishers("n") == node.count_subscribers("/n") == 1
    assert ("/n", ["std_msgs/msg/Int32"]) in node.get_topic_names_and_types()
    assert node.get_node_names_and_namespaces() == [("robot", "/")]


def test_a_full_queue_keeps_the_newest_messages(world: World) -> None:
    heard: list[int] = []
    subscription = world.node.create_subscription(Int32, "n", lambda m: heard.append(m.data), 2)
    publisher = world.node.create_publisher(Int32, "n", 10)
    eventually(lambda: publisher.get_subscription_count() == 1, "the link")
    for number in range(5):
        publisher.publish(Int32(number))
    eventually(lambda: _last(subscription._queue) == 4, "the newest message")
    world.spin_until(lambda: len(heard) == 2, "two messages")
    world.executor.spin_once(timeout_sec=0)
    assert heard == [3, 4]


def _last(messages: Any) -> Any:
    return messages[-1][0].data if messages else None


def test_transient_local_reaches_late_subscriptions(world: World) -> None:
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    world.node.create_publisher(String, "map", latched).publish(String(data="here"))
    heard: list[str] = []
    world.node.create_subscription(String, "map", lambda m: heard.append(m.data), latched)
    world.spin_until(lambda: heard, "the message")
    assert heard == ["here"]


def test_kept_messages_are_not_for_volatile_subscriptions(world: World) -> None:
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    publisher = world.node.create_publisher(String, "map", latched)
    publisher.publish(String(data="kept"))
    heard: list[str] = []
    world.node.create_subscription(String, "map", lambda m: heard.append(m.data), 10)
    volatile = QoSProfile(depth=1)
    world.node.create_subscription(String, "map", lambda m: heard.append(m.data), volatile)
    eventually(lambda: publisher.get_subscription_count() == 2, "the subscriptions")
    for _ in range(10):
        world.executor.spin_once(timeout_sec=0.03)
    publisher.publish(String(data="live"))
    world.spin_until(lambda: len(heard) == 2, "two messages")
    assert heard == ["live", "live"]


def test_timers(world: World) -> None:
    ticks: list[int] = []
    timer = world.node.create_timer(0.01, lambda: ticks.append(1))
    world.spin_until(lambda: len(ticks) == 3, "three ticks")
    timer.cancel()
    assert timer.is_canceled()
    assert timer.time_until_next_call() is None
    count = len(ticks)
    world.executor.spin_once(timeout_sec=0.05)
    assert len(ticks) == count
    timer.reset()
    world.spin_until(lambda: len(ticks) > count, "a tick after the reset")
    assert timer.timer_period_ns == 10_000_000
    assert world.node.destroy_timer(timer)
    assert not world.node.destroy_timer(timer)


def test_missed_timer_periods_are_skipped(world: World) -> None:
    ticks: list[int] = []
    timer = world.node.create_timer(0.005, lambda: ticks.append(1))
    eventually(timer.is_ready, "the timer")
    eventually(lambda: timer.time_since_last_call() > 4 * timer.timer_period_ns, "more periods")
    assert timer._timer is not None
    timer._timer.close()
    world.executor.spin_once(timeout_sec=0)
    world.executor.spin_once(timeout_sec=0)
    assert ticks == [1]


def test_spin_raises_exceptions_of_callbacks(world: World) -> None:
    world.node.create_timer(0.001, lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        world.executor.spin()


def test_services(world: World) -> None:
    where: list[threading.Thread] = []

    def serve(request: Any, response: Any) -> Any:
        where.append(threading.current_thread())
        response.success, response.message = request.data, "done"
        return response

    service = world.node.create_service(SetBool, "switch", serve)
    client = world.node.create_client(SetBool, "switch")
    assert client.wait_for_service(timeout_sec=TIMEOUT)
    assert client.service_is_ready()
    future = client.call_async(SetBool.Request(data=True))
    done: list[Future] = []
    future.add_done_callback(done.append)
    world.executor.spin_until_future_complete(future, timeout_sec=TIMEOUT)
    assert future.done()
    assert done == [future]
    assert future.result() == SetBool.Response(success=True, message="done")
    assert where == [threading.current_thread()]
    assert (service.srv_name, client.srv_name) == ("/switch", "/switch")
    assert ("/switch", ["std_srvs/srv/SetBool"]) in world.node.get_service_names_and_types()


def test_an_async_callback_can_await_a_service(world: World) -> None:
    async def serve(request: Any, response: Any) -> Any:
        inner = await world.node.create_client(SetBool, "inner").call_async(request)
        response.message = f"outer {inner.message}"
        return response

    def inner(_: Any, response: Any) -> Any:
        response.message = "inner"
        return response

    world.node.create_service(SetBool, "inner", inner)
    world.node.create_service(SetBool, "outer", serve)
    future = world.node.create_client(SetBool, "outer").call_async(SetBool.Request())
    world.executor.spin_until_future_complete(future, timeout_sec=TIMEOUT)
    assert future.result().message == "outer inner"


def test_a_failing_service_reports_to_its_caller_and_to_spin(world: World) -> None:
    def serve(_request: Any, _response: Any) -> Any:
        raise ValueError("no hand")

    world.node.create_service(SetBool, "switch", serve)
    future = world.node.create_client(SetBool, "switch").call_async(SetBool.Request())
    with pytest.raises(ValueError, match="no hand"):
        world.executor.spin_until_future_complete(future, timeout_sec=TIMEOUT)
    world.executor.spin_until_future_complete(future, timeout_sec=TIMEOUT)
    with pytest.raises(ServiceError, match="no hand"):
        future.result()


def test_a_service_without_a_server(world: World) -> None:
    client = world.node.create_client(SetBool, "nothing")
    assert not client.service_is_ready()
    assert not client.wait_for_service(timeout_sec=0.01)
    future = client.call_async(SetBool.Request())
    world.executor.spin_until_future_complete(future, timeout_sec=0.01)
    assert not future.done()
    client.remove_pending_request(future)
    assert future.cancelled()


def test_declare_and_get_parameters(world: World) -> None:
    node = world.node
    assert node.declare_parameter("speed", 1.5).value == 1.5
    node.declare_parameters("pid", [("p", 1), ("name", "x", ParameterDescriptor()), ("i",)])
    assert node.get_parameter("pid.p").get_parameter_value().integer_value == 1
    assert node.get_parameter("pid.name").value == "x"
    assert [one.value for one in node.get_parameters(["speed", "pid.p"])] == [1.5, 1]
    assert sorted(node.get_parameters_by_prefix("pid")) == ["i", "name", "p"]
    assert node.has_parameter("use_sim_time")
    assert node.get_parameter_or("nothing", 5) == 5
    with pytest.raises(exceptions.ParameterAlreadyDeclaredException, match="speed"):
        node.declare_parameter("speed", 2.0)
    with pytest.raises(exceptions.ParameterNotDeclaredException, match="nothing"):
        node.get_parameter("nothing")
    with pytest.raises(exceptions.ParameterUninitializedException, match=r"pid\.i"):
        node.get_parameter("pid.i")
    node.undeclare_parameter("speed")
    assert not node.has_parameter("speed")


def test_set_and_check_parameters(world: World) -> None:
    node = world.node
    node.declare_parameter("speed", 1.5)
    node.declare_parameter("fixed", 1, ParameterDescriptor(read_only=True))
    (good,) = node.set_parameters([Parameter("speed", value=2.5)])
    assert good.successful
    assert node.get_parameter("speed").value == 2.5
    (wrong,) = node.set_parameters([Parameter("speed", value="fast")])
    assert not wrong.successful
    assert wrong.reason == "Wrong parameter type, expected '3' got '4'"
    assert not node.set_parameters_atomically([Parameter("fixed", value=2)]).successful

    def check(parameters: list[Parameter]) -> SetParametersResult:
        slow = all(one.value < 3.0 for one in parameters)
        return SetParametersResult(successful=slow, reason="" if slow else "too fast")

    node.add_on_set_parameters_callback(check)
    assert node.set_parameters([Parameter("speed", value=9.0)])[0].reason == "too fast"
    assert node.get_parameter("speed").value == 2.5
    node.remove_on_set_parameters_callback(check)
    assert node.set_parameters([Parameter("speed", value=9.0)])[0].successful


def test_numbers_in_a_range(world: World) -> None:
    node = world.node
    even = IntegerRange(from_value=0, to_value=10, step=2)
    node.declare_parameter("even", 4, ParameterDescriptor(integer_range=[even]))
    limits = FloatingPointRange(from_value=-1.0, to_value=1.0)
    node.declare_parameter("share", 0.5, ParameterDescriptor(floating_point_range=[limits]))
    given = [("even", 10), ("even", 12), ("even", 5), ("share", -1.0), ("share", -1.5)]
    results = node.set_parameters([Parameter(name, value=value) for name, value in given])
    assert [result.reason for result in results] == [
        "",
        "Parameter even out of range. Min: 0, Max: 10, value: 12",
        "The parameter value for even is not a valid step. Min: 0, max: 10, value: 5, step: 2",
        "",
        "Parameter share out of range. Min: -1.0, Max: 1.0, value: -1.5",
    ]
    (deleted,) = node.set_parameters([Parameter("even")])
    assert deleted.reason == "Static parameter cannot be undeclared"
    assert node.get_parameter("even").value == 10


def test_callbacks_check_what_others_set(world: World, network: Network) -> None:
    """They run on the executor's thread, once for each change, and tell why they refuse it."""
    node, calls = world.node, list[tuple[str, Any]]()
    node.declare_parameter("speed", 1.5)

    def check(parameters: list[Parameter]) -> SetParametersResult:
        calls.append((threading.current_thread().name, parameters[0].value))
        return SetParametersResult(successful=parameters[0].value < 3, reason="too fast")

    node.add_on_set_parameters_callback(check)
    results: list[Any] = []

    def ask() -> None:
        asker = network.node("asker")
        with asker.client("/robot/set_parameters", SetParameters) as client:
            client.wait_for_service(TIMEOUT)
            for speed in (9.0, 2.0):
                message = Parameter("speed", value=speed).to_parameter_msg()
                results.extend(client([message]).results)

    network.thread(ask)
    world.spin_until(lambda: len(results) == 2, "the answers")
    assert [(each.successful, each.reason) for each in results] == [
        (False, "too fast"),
        (True, ""),
    ]
    assert calls == [(threading.current_thread().name, 9.0), (threading.current_thread().name, 2.0)]
    assert node.get_parameter("speed").value == 2.0


def test_parameters_of_the_command_line(start: Start) -> None:
    world = World(
        start, "robot", "--ros-args", "-p", "speed:=3", "-p", "other:x:=1", "-r", "__node:=me",
        "-r", "in:=/out", "-p", "wrong:=text",
    )  # fmt: skip
    assert world.node.declare_parameter("speed", 1.0).value == 3.0
    assert world.node.declare_parameter("x", 5).value == 5
    with pytest.raises(exceptions.InvalidParameterTypeException, match="wrong"):
        world.node.declare_parameter("wrong", 1.0)
    assert world.node.get_fully_qualified_name() == "/me"
    assert world.node.resolve_topic_name("in") == "/out"
    assert world.node.resolve_topic_name("in", only_expand=True) == "/in"


def test_parameters_are_in_the_parameter_store(world: World, network: Network) -> None:
    other = network.node("other")
    other.params.set("/robot/speed", 4)
    eventually(lambda: world.node.rosz_node.params.has("~speed"), "the parameter")
    assert world.node.declare_parameter("speed", 1.0).value == 4.0
    world.node.declare_parameter("pid.p", 1.0)
    assert other.params.get("/robot/pid/p") == 1.0
    other.params.set("/robot/speed", 5)
    world.spin_until(lambda: world.node.get_parameter("speed").value == 5.0, "the new value")
    other.params.set("/robot/speed", "fast")
    world.node.set_parameters([Parameter("pid.p", value=2.0)])
    world.executor.spin_once(timeout_sec=0.05)
    assert world.node.get_parameter("speed").value == 5.0


def test_names_and_clock(start: Start) -> None:
    world = World(start, "robot", namespace="/ns")
    node = world.node
    assert (node.get_name(), node.get_namespace()) == ("robot", "/ns")
    assert node.get_logger().name == "ns.robot"
    now = node.get_clock().now()
    assert now.clock_type is ClockType.ROS_TIME
    assert node.get_clock().sleep_for(Duration(nanoseconds=1))
    assert node.get_clock().now() > now
    assert not node.get_clock().ros_time_is_active
    rate = node.create_rate(1000.0)
    rate.sleep()
    world.context.shutdown()
    with pytest.raises(exceptions.ROSInterruptException):
        rate.sleep()


def test_the_ends_of_a_topic(world: World) -> None:
    node = world.node
    profile = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_publisher(Int32, "n", profile)
    node.create_subscription(Int32, "n", lambda _: None, 1)
    (publisher,) = node.get_publishers_info_by_topic("n")
    assert (publisher.node_name, publisher.node_namespace) == ("robot", "/")
    assert (publisher.topic_type, publisher.endpoint_type.name) == (
        "std_msgs/msg/Int32",
        "PUBLISHER",
    )
    assert publisher.topic_type_hash.startswith("RIHS01_")
    assert len(publisher.endpoint_gid) == 16
    assert publisher.qos_profile.depth == 3
    assert publisher.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
    (subscription,) = node.get_subscriptions_info_by_topic("/n", no_mangle=True)
    assert subscription.endpoint_type.name == "SUBSCRIPTION"
    assert subscription.endpoint_gid != publisher.endpoint_gid
    assert node.get_publishers_info_by_topic("other") == []


def test_no_node_without_init() -> None:
    with pytest.raises(exceptions.NotInitializedException, match="cannot create node"):
        Node("robot", context=Context())


def test_destroying_a_node(world: World) -> None:
    publisher = world.node.create_publisher(Int32, "n", 10)
    world.node.destroy_node()
    world.node.destroy_node()
    assert world.executor.get_nodes() == []
    with pytest.raises(ClosedError):
        publisher.publish(Int32())
    world.context.shutdown()
    world.context.shutdown()
    assert not world.context.ok()
    world.executor.spin()


def test_several_threads(start: Start) -> None:
    context = start()
    node = Node("robot", context=context)
    meeting = threading.Barrier(2)
    met = threading.Semaphore(0)

    def meet() -> None:
        with suppress(threading.BrokenBarrierError):  # the end of the test
            meeting.wait(TIMEOUT)
            met.release()

    group = ReentrantCallbackGroup()
    for _ in range(2):
        node.create_timer(0.01, meet, callback_group=group)
    with executors.MultiThreadedExecutor(2, context=context) as executor:
        executor.add_node(node)
        threading.Thread(target=executor.spin, daemon=True).start()
        assert met.acquire(timeout=TIMEOUT)
        meeting.abort()
        context.shutdown()


def test_an_executor_that_is_shut_down_while_it_finds_a_callback(world: World) -> None:
    """The callback is not run, and nothing is raised on the thread that spins."""
    calls: list[int] = []
    executor = executors.MultiThreadedExecutor(2, context=world.context)

    class Group(ReentrantCallbackGroup):
        def enter(self) -> bool:
            executor.shutdown()
            return super().enter()

    world.executor.remove_node(world.node)
    executor.add_node(world.node)
    group = Group()
    world.node.create_timer(0.001, lambda: calls.append(1), callback_group=group)
    executor.spin()
    assert calls == []


def test_exclusive_callback_groups(start: Start) -> None:
    context = start()
    node = Node("robot", context=context)
    inside = threading.Lock()
    both = threading.Semaphore(0)
    clashes: list[int] = []
    group = MutuallyExclusiveCallbackGroup()

    def alone() -> None:
        if not inside.acquire(blocking=False):
            clashes.append(1)
            return
        threading.Event().wait(0.01)
        inside.release()
        both.release()

    for _ in range(2):
        node.create_timer(0.001, alone, callback_group=group)
    with executors.MultiThreadedExecutor(4, context=context) as executor:
        executor.add_node(node)
        threading.Thread(target=executor.spin, daemon=True).start()
        for _ in range(10):
            assert both.acquire(timeout=TIMEOUT)
        context.shutdown()
    assert clashes == []


def test_tasks(world: World) -> None:
    first = world.executor.create_task(lambda a, b: a + b, 1, b=2)

    async def second() -> int:
        return int(await first) * 10

    task = world.executor.create_task(second)
    world.executor.spin_until_future_complete(task, timeout_sec=TIMEOUT)
    assert (first.result(), task.result()) == (3, 30)


def test_asyncio_awaits_futures(world: World) -> None:
    """A coroutine of asyncio awaits what callbacks and coroutines of the executor complete."""
    done, inner = Future(), Future()

    async def spun() -> str:
        return str(await inner)

    async def main() -> list[str]:
        task = world.executor.create_task(spun)
        guard = world.node.create_guard_condition(lambda: inner.set_result("inner"))

        async def spin() -> None:
            while True:
                world.executor.spin_once(timeout_sec=0)
                await asyncio.sleep(0)

        spinning = asyncio.create_task(spin())
        guard.trigger()
        world.executor.call_soon(lambda: done.set_result("done"))
        results = [await done, await task]
        spinning.cancel()
        return results

    assert asyncio.run(asyncio.wait_for(main(), TIMEOUT)) == ["done", "inner"]


def test_simulated_time_begins_and_ends_while_the_node_runs(world: World, network: Network) -> None:
    """Jump callbacks are told of it, and of jumps that are large enough."""
    node, told = world.node, list[object]()
    ticks: list[bool] = []
    node.create_timer(0.01, lambda: ticks.append(node.get_clock().ros_time_is_active))
    threshold = JumpThreshold(
        min_forward=Duration(seconds=60), min_backward=Duration(nanoseconds=-1)
    )
    handle = node.get_clock().create_jump_callback(
        threshold,
        pre_callback=lambda: told.append(node.get_clock().ros_time_is_active),
        post_callback=told.append,
    )
    other = network.node("other")
    other.params["/robot/use_sim_time"] = True
    world.spin_until(lambda: node.get_clock().ros_time_is_active, "simulated time")
    assert node.get_parameter("use_sim_time").value is True
    clock = other.publisher("/clock", ClockMessage)
    clock.wait_for_subscribers()
    seconds = 0.0

    def ticked() -> bool:
        nonlocal seconds
        seconds += 0.01
        clock.publish(ClockMessage(TimeMessage(*divmod(round(seconds * 1e9), 10**9))))
        return node.get_clock().now().nanoseconds > 0 and True in ticks

    ticks.clear()
    world.spin_until(ticked, "a tick of simulated time")
    for moment, count in ((1000, 4), (2, 6)):
        clock.publish(ClockMessage(TimeMessage(moment)))
        world.spin_until(lambda count=count: len(told) == count, "a jump")  # type: ignore[misc]
    ticks.clear()
    node.set_parameters([Parameter("use_sim_time", value=False)])
    world.spin_until(lambda: False in ticks, "a tick of wall time")
    assert told[::2] == [False, True, True, True]
    jumps = [jump for jump in told if isinstance(jump, TimeJump)]
    change = ClockChange.ROS_TIME_NO_CHANGE
    assert [jump.clock_change for jump in jumps] == [
        ClockChange.ROS_TIME_ACTIVATED,
        change,
        change,
        ClockChange.ROS_TIME_DEACTIVATED,
    ]
    assert jumps[2].delta == Duration(seconds=-998)
    handle.unregister()
    node.set_parameters([Parameter("use_sim_time", value=True)])
    assert len(told) == 8


def test_jumps_that_cannot_be(world: World) -> None:
    with pytest.raises(ValueError, match="min_forward must be"):
        JumpThreshold(min_forward=Duration(), min_backward=None)
    with pytest.raises(ValueError, match="min_backward must be"):
        JumpThreshold(min_forward=None, min_backward=Duration(seconds=1))
    threshold = JumpThreshold(min_forward=None, min_backward=None)
    with pytest.raises(ValueError, match="must be callable"):
        world.node.get_clock().create_jump_callback(threshold)


def test_shutdown_ends_all_that_spin(start: Start, network: Network) -> None:
    executor = executors.SingleThreadedExecutor(context=start())
    threads = [network.thread(executor.spin_once) for _ in range(3)]
    eventually(lambda: len(executor._wakeups) == len(threads))
    executor.shutdown()
    for thread in threads:
        thread.join(TIMEOUT)
        assert not thread.is_alive()
    assert executor._wakeups == []
