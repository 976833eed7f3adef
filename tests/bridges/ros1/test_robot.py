"""Goals, settings, transforms and simulated time between roscpp programs and rosz."""

from __future__ import annotations

import itertools
import re
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from network import TIMEOUT, Program, eventually, repeats

from rosz.actions import ActionlibClient, ActionlibClientGoal, GoalState, ServerGoal
from rosz.errors import ActionError, GoalFailed, RoszError
from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rosz.msgs.rosgraph_msgs.msg import Clock
from rosz.msgs.std_msgs.msg import Header
from rosz.node import Node
from rosz.reconfigure import Client
from rosz.transforms import (
    Buffer,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformListener,
)

from .world import World, roscpp

pytestmark = [pytest.mark.ros1, pytest.mark.system]

SERVER = """
    import rosz.ros1
    import actionlib, rospy
    from actionlib.msg import TestAction, TestFeedback, TestResult

    def execute(goal):
        print("goal", goal.goal)
        if goal.goal < 0:
            server.set_aborted(TestResult(goal.goal), "negative")
            return
        rate, count = rospy.Rate(50), 0
        while count < goal.goal and not rospy.is_shutdown():
            if server.is_preempt_requested():
                why = "by another" if server.is_new_goal_available() else "by cancel"
                server.set_preempted(TestResult(count), why)
                return
            server.publish_feedback(TestFeedback(count))
            count += 1
            rate.sleep()
        server.set_succeeded(TestResult(count), "counted")

    rospy.init_node("goals_of_rosz")
    server = actionlib.SimpleActionServer("count", TestAction, execute, auto_start=False)
    server.start()
    print("ready")
    rospy.spin()
"""
ENDLESS = "1000000"
_DYNPARAM = Path("/usr/lib/dynamic_reconfigure/dynparam")
"""ROS 1's own command (Debian: python3-dynamic-reconfigure)."""

STATES = ("SUCCEEDED", "ABORTED", "PREEMPTED")

Start = Callable[..., Program]


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    _robot()
    made = World()
    yield made
    made.close()


@pytest.fixture
def node(world: World) -> Iterator[Node]:
    with Node("neighbour", context=world.network.context()) as made:
        yield made


@pytest.fixture
def robot(world: World) -> Iterator[Start]:
    """Start the roscpp program in a role; it ends with the test."""
    started: list[Program] = []

    def start(*argv: str) -> Program:
        started.append(world.start(_robot(), *argv))
        return started[-1]

    yield start
    for program in started:
        program.kill()
    eventually(lambda: not world.bridge.nodes())


def _robot() -> str:
    return roscpp("robot", "actionlib", "dynamic_reconfigure", "tf2_ros")


def _states(program: Program) -> list[tuple[str, str]]:
    """Return state and text of each goal that has ended."""
    ended = (line.split(None, 2) for line in program.lines if line.split()[0] in STATES)
    return [(state, text) for state, _, text in ended]


def test_goals_of_roscpp_clients(world: World, robot: Start) -> None:
    server = world.network.program(SERVER)
    server.wait_for("ready")
    for words, expected in (
        (("3",), ("SUCCEEDED", "counted")),
        (("-1",), ("ABORTED", "negative")),
        ((ENDLESS, "cancel"), ("PREEMPTED", "by cancel")),
    ):
        goal = robot("goal", *words)
        assert goal.exit_code() == 0
        assert _states(goal) == [expected]
    first = robot("goal", ENDLESS)
    first.wait_for("feedback")
    killed = robot("goal", ENDLESS)
    killed.wait_for("feedback")
    assert first.exit_code() == 0
    assert _states(first) == [("PREEMPTED", "by another")]
    killed.kill()
    waiting = robot("goal", ENDLESS)
    waiting.wait_for("feedback")
    server.kill()
    waiting.wait_for("server lost")


def _client(node: Node) -> ActionlibClient:
    """Return a client that sees the server."""
    client = ActionlibClient(node, "count", node.context.types.message("actionlib/TestAction"))
    assert client.wait_for_server(TIMEOUT)
    return client


def _send(client: ActionlibClient, goal: int) -> tuple[ActionlibClientGoal, threading.Event]:
    """Send a goal; return it with an event that its feedback sets."""
    begun = threading.Event()
    message = client.node.context.types.message("actionlib/TestGoal")(goal)
    return client.send(message, on_feedback=lambda _: begun.set()), begun


def _ended(goal: ActionlibClientGoal) -> tuple[int, str]:
    assert goal.wait(TIMEOUT)
    return goal.status.status, goal.status.text


def test_goals_for_a_roscpp_server(world: World, robot: Start) -> None:
    server = robot("goals")
    server.wait_for("ready")
    for _ in range(repeats(3, 20)):  # the first goal of a process, sent once it sees the server
        with Node("first", context=world.network.context()) as node:
            canceled, begun = _send(_client(node), int(ENDLESS))
            assert begun.wait(TIMEOUT)
            canceled.cancel()
            assert _ended(canceled) == (GoalStatus.PREEMPTED, "by cancel")
    with Node("second", context=world.network.context()) as node:
        client = _client(node)
        preempted, begun = _send(client, int(ENDLESS))
        assert begun.wait(TIMEOUT)
        last, _ = _send(client, 3)
        assert _ended(preempted) == (GoalStatus.PREEMPTED, "by another")
        assert _ended(last) == (GoalStatus.SUCCEEDED, "counted")
        assert _ended(_send(client, -1)[0]) == (GoalStatus.ABORTED, "negative")
    server.close()  # its last line may come after its last result
    received = sum(line.startswith("goal") for line in server.lines)
    assert received == repeats(3, 20) + 3  # each once


def test_goals_of_roscpp_clients_for_a_server_of_ros2(robot: Start, node: Node) -> None:
    count = node.context.types.action("actionlib/Test")
    executed: list[int] = []

    def execute(goal: ServerGoal) -> None:
        executed.append(goal.request.goal)
        goal.feedback(count.Feedback(1))
        if goal.request.goal < 0:
            goal.abort(count.Result(-1))
        elif goal.request.goal == int(ENDLESS):
            while not goal.wait_for_cancel(TIMEOUT):
                pass
            goal.canceled(count.Result(7))
        else:
            goal.succeed(count.Result(goal.request.goal))

    early = robot("goal", "3")  # which waits for a server
    server = node.action_server("count", count, execute)
    early.wait_for("SUCCEEDED 3")
    assert early.exit_code() == 0
    robot("goal", "-1").wait_for("ABORTED -1")
    robot("goal", ENDLESS, "cancel").wait_for("PREEMPTED 7")
    two = [robot("goal", ENDLESS), robot("goal", ENDLESS, "cancel")]
    two[0].wait_for("feedback")
    two[1].wait_for("PREEMPTED 7")
    assert two[0].process.poll() is None
    server.close()
    two[0].wait_for(re.compile("ABORTED|server lost"))
    assert executed == [3, -1, *[int(ENDLESS)] * 3]  # each once


def test_goals_of_ros2_clients_for_a_roscpp_server(robot: Start, node: Node) -> None:
    count = node.context.types.action("actionlib/Test")
    client = node.action_client("count", count)
    server = robot("goals")
    client.wait_for_server(TIMEOUT)
    goal = client.send(count.Goal(3), timeout=TIMEOUT)
    assert goal.result(TIMEOUT).result == 3
    with pytest.raises(GoalFailed) as failed:
        client.send(count.Goal(-1), timeout=TIMEOUT).result(TIMEOUT)
    assert (failed.value.status, failed.value.result.result) == (GoalState.ABORTED, -1)
    goal = client.send(count.Goal(int(ENDLESS)), timeout=TIMEOUT)
    assert next(iter(goal)).feedback == 0
    assert goal.cancel(TIMEOUT)
    assert goal.wait(TIMEOUT) is GoalState.CANCELED
    replaced = client.send(count.Goal(int(ENDLESS)), timeout=TIMEOUT)
    assert next(iter(replaced)).feedback == 0
    last = client.send(count.Goal(int(ENDLESS)), timeout=TIMEOUT)
    assert replaced.wait(TIMEOUT) is GoalState.CANCELED
    assert next(iter(last)).feedback == 0
    server.kill()
    with pytest.raises(ActionError):
        last.result(TIMEOUT)
    assert sum(line.startswith("goal") for line in server.lines) == 5  # each once


def test_settings_of_a_roscpp_node(world: World, robot: Start, node: Node) -> None:
    program = robot("configured", "__name:=configured")
    with Client(node, "configured") as client:
        client.wait(TIMEOUT)
        assert client.update({"int_": 3, "bool_": False}, TIMEOUT)["bool_"] is False
        program.wait_for("int 3 ")
        assert client.update({"int_": 7}, TIMEOUT)["str_"] == "corrected"
    assert node.params["/configured/int_"] == 7
    if _DYNPARAM.exists():
        assert world.run(str(_DYNPARAM), "list").strip() == "/configured"
        assert "'int_': 7" in world.run(str(_DYNPARAM), "get", "/configured")


def _transform(node: Node, parent: str, child: str) -> TransformStamped:
    return TransformStamped(
        header=Header(stamp=Time.from_nsec(node.now()), frame_id=parent),
        child_frame_id=child,
        transform=Transform(translation=Vector3(x=1.0), rotation=Quaternion(w=1.0)),
    )


def test_transforms_of_roscpp_nodes(robot: Start, node: Node) -> None:
    programs = [
        robot("fixed", "map", "odom"),
        robot("fixed", "odom", "base"),
        robot("moving", "base", "tool"),
    ]
    for program in programs:
        program.wait_for("ready")
    buffer = Buffer()
    listener = TransformListener(buffer, node)

    def distance() -> float:
        try:
            return buffer.lookup("map", "tool")[0].translation[0]
        except RoszError:
            return 0.0

    eventually(lambda: distance() == 3.0, "the transform from map to tool")
    late = robot("lookup", "map", "tool")
    late.wait_for("distance 3")
    listener.close()


def test_transforms_for_a_roscpp_node(world: World, robot: Start, node: Node) -> None:
    with Node("second", context=world.network.context()) as second:
        StaticTransformBroadcaster(node).send(_transform(node, "map", "odom"))
        StaticTransformBroadcaster(second).send(_transform(second, "odom", "base"))
        moving = TransformBroadcaster(node)
        timer = node.timer(0.05, lambda _: moving.send(_transform(node, "base", "tool")))
        robot("fixed", "tool", "tip")
        for _ in range(2):
            program = robot("lookup", "map", "tip")
            program.wait_for("distance 4")
            program.kill()
        timer.close()


def test_simulated_time_of_a_roscpp_node(robot: Start, node: Node) -> None:
    node.params["/use_sim_time"] = True
    program = robot("clock")
    program.wait_for("simulated yes")
    publisher = node.publisher("/clock", Clock)
    seconds = itertools.count(1000)

    def tick() -> bool:
        publisher.publish(Clock(clock=Time(next(seconds))))
        return any(re.match(r"timer \d{3}", line) for line in program.lines)

    eventually(tick, "a timer in simulated time")
    del node.params["/use_sim_time"]
    program.send(signal.SIGINT)
    assert program.exit_code() == 0
