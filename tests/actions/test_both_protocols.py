"""actionlib's clients and servers reach those of ROS 2, and each goal is executed once."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from functools import partial
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.actions import (
    ActionlibClient,
    ActionlibClientGoal,
    ActionlibServer,
    CommState,
    GoalState,
    SimpleActionServer,
    list_actions,
)
from rosz.actions.translation import ActionlibToRos2
from rosz.actions.types import ActionTypes
from rosz.errors import ActionError, GoalFailed, GoalRejected
from rosz.introspect.services import list_services
from rosz.introspect.topics import list_topics
from rosz.msgs.action_msgs.msg import GoalInfo
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus
from rosz.msgs.actionlib_tutorials.action import Fibonacci
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.unique_identifier_msgs.msg import UUID


class World:
    """Two nodes, each on a session of its own, and the message classes of ROS 1."""

    def __init__(self, network: Network) -> None:
        self.one, self.other = network.node("one"), network.node("other")
        types = self.one.context.types
        self.action: Any = types.message("actionlib_tutorials/FibonacciAction")
        self.goal: Any = types.message("actionlib_tutorials/FibonacciGoal")
        self.result: Any = types.message("actionlib_tutorials/FibonacciResult")
        self.feedback: Any = types.message("actionlib_tutorials/FibonacciFeedback")
        self.arrived: SimpleQueue[Any] = SimpleQueue()
        self.over = threading.Event()

    def next(self) -> Any:
        return self.arrived.get(timeout=TIMEOUT)

    def ros2_server(self, **options: Any) -> Any:
        """A server of ROS 2; it hands goals to the test, which ends them."""

        def execute(goal: Any) -> None:
            self.arrived.put(goal)
            while not (goal.done or self.over.wait(0.002)):
                pass

        return self.other.action_server("fib", Fibonacci, execute, **options)

    def ros1_client(self) -> ActionlibClient:
        client = ActionlibClient(self.one, "fib", self.action)
        assert client.wait_for_server(TIMEOUT)
        return client

    def ros1_server(self, **callbacks: Any) -> ActionlibServer:
        """A server of actionlib; it hands goals to the test."""
        callbacks = {"on_goal": self.arrived.put, **callbacks}
        server = ActionlibServer(self.other, "fib", self.action, **callbacks)
        server.start()
        return server

    def ros2_client(self) -> Any:
        client = self.one.action_client("fib", Fibonacci)
        client.wait_for_server(TIMEOUT)
        return client


@pytest.fixture
def world(network: Network, monkeypatch: pytest.MonkeyPatch) -> Iterator[World]:
    monkeypatch.setattr("rosz.actions.translation._KNOWN_TIMEOUT", TIMEOUT)
    made = World(network)
    yield made
    made.over.set()


def is_canceling(goal: Any) -> bool:
    return goal.status is GoalState.CANCELING


def reaches(goal: ActionlibClientGoal, status: int) -> None:
    eventually(lambda: goal.status.status == status, f"status {status}")


ENDS = {
    "succeed": (GoalState.SUCCEEDED, GoalStatus.SUCCEEDED),
    "abort": (GoalState.ABORTED, GoalStatus.ABORTED),
    "canceled": (GoalState.CANCELED, GoalStatus.PREEMPTED),
}


@pytest.mark.parametrize("end", ENDS)
def test_a_server_of_ros2_executes_a_goal_of_actionlib(world: World, end: str) -> None:
    world.ros2_server()
    events: SimpleQueue[Any] = SimpleQueue()
    sent = world.ros1_client().send(
        world.goal(7),
        on_done=lambda _: events.put("done"),
        on_active=lambda: events.put("active"),
        on_feedback=lambda feedback: events.put(list(feedback.sequence)),
    )
    goal = world.next()
    assert goal.request.order == 7
    assert events.get(timeout=TIMEOUT) == "active"
    reaches(sent, GoalStatus.ACTIVE)
    goal.feedback(Fibonacci.Feedback([0, 1]))
    assert events.get(timeout=TIMEOUT) == [0, 1]
    if end == "canceled":
        sent.cancel()
        assert goal.wait_for_cancel(TIMEOUT)
        reaches(sent, GoalStatus.PREEMPTING)
    getattr(goal, end)(Fibonacci.Result([3]))
    assert sent.wait(TIMEOUT)
    assert (goal.status, sent.status.status) == ENDS[end]
    assert list(sent.result.sequence) == [3]
    assert isinstance(sent.result, world.result)
    assert sent.comm_state == CommState.DONE
    assert events.get(timeout=TIMEOUT) == "done"
    assert world.arrived.empty()


def test_a_server_of_ros2_rejects_or_delays_a_goal_of_actionlib(world: World) -> None:
    world.ros2_server(goal=lambda goal: goal.order > 0, policy="queue")
    client = world.ros1_client()
    rejected = client.send(world.goal(0))
    assert rejected.wait(TIMEOUT)
    assert rejected.status.status == GoalStatus.REJECTED
    first, second = client.send(world.goal(1)), client.send(world.goal(2))
    running = world.next()
    eventually(lambda: second.comm_state == CommState.PENDING, "the wait of the second goal")
    assert second.status.status == GoalStatus.PENDING
    second.cancel()
    assert second.wait(TIMEOUT)
    assert second.status.status == GoalStatus.PREEMPTED
    client.publish_cancel(GoalID())
    assert running.wait_for_cancel(TIMEOUT)
    running.canceled()
    assert first.wait(TIMEOUT)
    assert first.status.status == GoalStatus.PREEMPTED


def test_the_end_of_a_server_of_ros2_loses_the_goal(world: World) -> None:
    server = world.ros2_server()
    sent = world.ros1_client().send(world.goal(1))
    world.next()
    server.close()
    assert sent.wait(TIMEOUT)
    assert sent.status.status == GoalStatus.LOST
    assert "is lost" in sent.status.text


@pytest.mark.parametrize(
    ("end", "state"),
    [
        ("succeed", GoalState.SUCCEEDED),
        ("abort", GoalState.ABORTED),
        ("cancel", GoalState.CANCELED),
    ],
)
def test_actionlib_executes_a_goal_of_ros2(world: World, end: str, state: GoalState) -> None:
    world.ros1_server()
    seen: SimpleQueue[Any] = SimpleQueue()
    sent = world.ros2_client().send(
        Fibonacci.Goal(7), feedback=lambda feedback: seen.put(list(feedback.sequence))
    )
    goal = world.next()
    assert goal.id.id == str(sent.id)
    assert goal.message.goal.order == 7
    assert sent.status is GoalState.ACCEPTED
    goal.accept()
    eventually(lambda: sent.status is GoalState.EXECUTING, "the execution")
    goal.publish_feedback(world.feedback([0, 1]))
    assert seen.get(timeout=TIMEOUT) == [0, 1]
    getattr(goal, end)(world.result([3]))
    assert sent.wait(TIMEOUT) is state
    try:
        result = sent.result()
    except GoalFailed as error:
        result = error.result
    assert list(result.sequence) == [3]
    assert world.arrived.empty()


def test_listings_show_only_the_topics_of_ros1(world: World) -> None:
    world.ros1_server()
    world.ros2_client()
    graph = world.one.context.graph
    topics = {f"/fib/{part}" for part in ("goal", "cancel", "status", "feedback", "result")}

    def listed() -> set[str]:
        return {one.name for one in list_topics(graph.view().tokens) if "fib" in one.name}

    eventually(lambda: listed() == topics, "the topics")
    view = graph.view()
    assert not [entry for entry in list_services(view) if "fib" in entry.name]
    assert [(entry.name, entry.servers) for entry in list_actions(view)] == [("/fib", ("/other",))]


def test_a_client_of_ros2_cancels_goals_of_actionlib(world: World) -> None:
    cancelled: SimpleQueue[Any] = SimpleQueue()
    world.ros1_server(on_cancel=cancelled.put)
    client = world.ros2_client()
    waiting, running = client.send(Fibonacci.Goal(1)), client.send(Fibonacci.Goal(2))
    first, second = world.next(), world.next()
    second.accept()
    for sent, goal, status in (
        (waiting, first, GoalStatus.RECALLING),
        (running, second, GoalStatus.PREEMPTING),
    ):
        assert sent.cancel()
        assert cancelled.get(timeout=TIMEOUT) is goal
        assert goal.status.status == status
        eventually(partial(is_canceling, sent), "the cancellation")
        goal.cancel(text="as you like")
        assert sent.wait(TIMEOUT) is GoalState.CANCELED
    assert first.status.status == GoalStatus.RECALLED
    assert second.status.status == GoalStatus.PREEMPTED


@pytest.mark.parametrize("everything", [True, False])
def test_a_client_of_ros2_cancels_many_goals(world: World, everything: bool) -> None:
    """All goals of a server, or those sent until a time, whichever protocol they came by."""
    world.ros1_server(on_cancel=lambda goal: goal.cancel())
    one, other = world.ros1_client(), world.ros2_client()
    early = one.send(world.goal(1)), other.send(Fibonacci.Goal(2))
    for _ in early:
        world.next().accept()
    until = world.one.now()
    late = one.send(world.goal(3)), other.send(Fibonacci.Goal(4))
    arrived = [world.next() for _ in late]
    for goal in arrived:
        goal.accept()
    assert other.cancel_all(0 if everything else until) == (2 if everything else 1)
    for first, second in (early, late) if everything else (early,):
        assert first.wait(TIMEOUT)
        assert first.status.status == GoalStatus.PREEMPTED
        assert second.wait(TIMEOUT) is GoalState.CANCELED
    if not everything:
        assert not any(goal.done for goal in late)
        for goal in arrived:
            goal.succeed(world.result())
        assert late[0].wait(TIMEOUT)
        assert late[1].wait(TIMEOUT) is GoalState.SUCCEEDED


@pytest.mark.parametrize("everything", [True, False])
def test_a_client_of_actionlib_cancels_many_goals(world: World, everything: bool) -> None:
    world.ros1_server(on_cancel=lambda goal: goal.cancel())
    one, other = world.ros1_client(), world.ros2_client()
    early = other.send(Fibonacci.Goal(2))
    world.next().accept()
    until = Time.from_nsec(world.one.now())
    late = other.send(Fibonacci.Goal(4))
    arrived = world.next()
    arrived.accept()
    one.publish_cancel(GoalID() if everything else GoalID(stamp=until))
    assert early.wait(TIMEOUT) is GoalState.CANCELED
    if not everything:
        assert not late.done
        arrived.succeed(world.result())
    assert late.wait(TIMEOUT) is (GoalState.CANCELED if everything else GoalState.SUCCEEDED)


def test_a_goal_may_end_in_the_callback_that_cancels_it(world: World) -> None:
    world.ros1_server(on_cancel=lambda goal: goal.cancel())
    sent = world.ros2_client().send(Fibonacci.Goal(1))
    world.next()
    assert sent.cancel()
    assert sent.wait(TIMEOUT) is GoalState.CANCELED


def test_actionlib_rejects_goals_of_ros2(world: World) -> None:
    def decide(goal: Any) -> None:
        if goal.message.goal.order == 0:
            goal.reject(text="nothing to do")
        else:
            world.arrived.put(goal)

    world.ros1_server(on_goal=decide)
    client = world.ros2_client()
    with pytest.raises(GoalRejected):
        client.send(Fibonacci.Goal(0))
    late = client.send(Fibonacci.Goal(1))
    world.next().reject()
    assert late.wait(TIMEOUT) is GoalState.ABORTED


def test_the_end_of_actionlib_loses_a_goal_of_ros2(world: World) -> None:
    server = world.ros1_server()
    sent = world.ros2_client().send(Fibonacci.Goal(1))
    world.next().accept()
    server.stop()
    with pytest.raises(ActionError, match="is lost"):
        sent.wait(TIMEOUT)


def test_the_simple_server_lets_a_newer_goal_of_either_protocol_go_first(world: World) -> None:
    def execute(goal: Any) -> None:
        world.arrived.put(goal)
        eventually(lambda: server.is_preempt_requested() or goal.order < 0)
        if goal.order < 0:
            server.set_succeeded(world.result([goal.order]))
        else:
            server.set_preempted(world.result([goal.order]))

    server = SimpleActionServer(ActionlibServer(world.other, "fib", world.action), execute)
    server.start()
    old, new = world.ros2_client(), world.ros1_client()
    first = old.send(Fibonacci.Goal(1))
    assert world.next().order == 1
    second = new.send(world.goal(2))
    assert world.next().order == 2
    third = old.send(Fibonacci.Goal(-3))
    assert world.next().order == -3
    assert first.wait(TIMEOUT) is GoalState.CANCELED
    assert second.wait(TIMEOUT)
    assert second.status.status == GoalStatus.PREEMPTED
    assert third.wait(TIMEOUT) is GoalState.SUCCEEDED
    assert list(third.result().sequence) == [-3]
    assert world.arrived.empty()


def test_a_goal_that_is_sent_twice_is_executed_once(world: World) -> None:
    world.ros1_server()
    client = world.ros2_client()
    sent = client.send(Fibonacci.Goal(1))
    goal = world.next()
    request = Fibonacci.SendGoal.Request(UUID(sent.id.bytes), Fibonacci.Goal(1))
    repeat = world.one.client("fib/_action/send_goal", Fibonacci.SendGoal)
    assert repeat.call(request, TIMEOUT).accepted
    goal.accept()
    goal.succeed()
    assert sent.wait(TIMEOUT) is GoalState.SUCCEEDED
    assert repeat.call(request, TIMEOUT).accepted
    assert world.arrived.empty()
    assert not client.request_cancel(GoalInfo(UUID(sent.id.bytes)), TIMEOUT).goals_canceling


def test_goals_may_be_sent_while_others_are_cancelled(world: World) -> None:
    proxy = ActionlibToRos2(
        world.one, "/fib", ActionTypes.of(world.action, world.one.context.types), Fibonacci
    )
    client = ActionlibClient(world.one, "other", world.action, has_ros2=False)
    goals = [client.send(world.goal(1)) for _ in range(4000)]

    def send() -> None:
        for goal in goals:
            proxy.send(goal, world.goal(1))

    sender = threading.Thread(target=send)
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        sender.start()
        while sender.is_alive():
            proxy.cancel_all(GoalID(id="of another client"))
    finally:
        sys.setswitchinterval(interval)
        sender.join()
    assert all(map(proxy.has_sent, goals))
