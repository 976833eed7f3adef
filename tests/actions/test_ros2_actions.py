"""Actions by ROS 2's protocol: goals from start to end, and what goes wrong with them."""

from __future__ import annotations

import logging
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.actions import RESULT, ActionClient, ActionServer, ClientGoal, GoalState, ServerGoal
from rosz.errors import (
    ActionError,
    EncodeError,
    GoalFailed,
    GoalRejected,
    ServerSilent,
    ServiceError,
    ServiceNotFound,
    UsageError,
    WaitTimeout,
)
from rosz.msgs.action_msgs.msg import GoalInfo, GoalStatusArray
from rosz.msgs.action_msgs.srv import CancelGoal
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.msgs.unique_identifier_msgs.msg import UUID
from rosz.node.actions import server as action_server
from rosz.qos import LATCHED

Goal, Result, Feedback = Fibonacci.Goal, Fibonacci.Result, Fibonacci.Feedback


class World:
    """A server whose goals the test ends, and a client, each on a session of its own."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self.server_node, self.client_node = network.node("server"), network.node("client")
        self.started: SimpleQueue[ServerGoal] = SimpleQueue()
        self.over = threading.Event()

    def hold(self, goal: ServerGoal) -> None:
        """Show a goal to the test, and wait until the test has ended it."""
        self.started.put(goal)
        while not (goal.done or self.over.wait(0.002)):
            pass

    def server(
        self, execute: Callable[[ServerGoal], object] | None = None, **options: Any
    ) -> ActionServer:
        return self.server_node.action_server("fib", Fibonacci, execute or self.hold, **options)

    def client(self) -> ActionClient:
        client = self.client_node.action_client("fib", Fibonacci)
        client.wait_for_server(TIMEOUT)
        return client

    def next(self) -> ServerGoal:
        return self.started.get(timeout=TIMEOUT)


@pytest.fixture
def world(network: Network) -> Any:
    made = World(network)
    yield made
    made.over.set()


def test_a_goal_with_feedback(world: World) -> None:
    def execute(goal: ServerGoal) -> None:
        sequence = [0, 1]
        for _ in range(goal.request.order - 1):
            sequence.append(sequence[-1] + sequence[-2])
            goal.feedback(Feedback(sequence))
        goal.succeed(Result(sequence))

    world.server(execute)
    seen = []
    handle = world.client().send(Goal(5), feedback=lambda one: seen.append(list(one.sequence)))
    assert list(handle.result(TIMEOUT).sequence) == [0, 1, 1, 2, 3, 5]
    eventually(lambda: len(seen) == 4, "all feedback")
    assert seen[0] == [0, 1, 1]
    assert handle.status is GoalState.SUCCEEDED
    assert handle.done
    assert handle.accepted > 0


def test_feedback_is_iterated_until_the_end(world: World) -> None:
    world.server()
    handle = world.client().send(Goal(1))
    goal = world.next()
    goal.feedback(Feedback([1]))
    feedback = iter(handle)
    assert list(next(feedback).sequence) == [1]
    goal.succeed()
    assert next(feedback, None) is None
    assert list(handle) == []


def test_states_reach_the_client(world: World) -> None:
    world.server()
    handle = world.client().send(Goal(1))
    goal = world.next()
    assert goal.id == handle.id
    eventually(lambda: handle.status is GoalState.EXECUTING)
    assert handle.cancel()
    assert goal.wait_for_cancel(TIMEOUT)
    assert goal.cancel_requested
    eventually(lambda: handle.status is GoalState.CANCELING)
    goal.canceled(Result([7]))
    assert handle.wait(TIMEOUT) is GoalState.CANCELED
    with pytest.raises(GoalFailed, match="was canceled") as failed:
        handle.result()
    assert list(failed.value.result.sequence) == [7]
    assert not handle.cancel()


def test_a_canceled_goal_may_succeed_or_abort(world: World) -> None:
    world.server()
    client = world.client()
    for end in ("succeed", "abort"):
        handle = client.send(Goal(1))
        goal = world.next()
        assert handle.cancel()
        getattr(goal, end)()
        assert handle.wait(TIMEOUT).text == {"succeed": "succeeded", "abort": "aborted"}[end]


def test_what_a_goal_cannot_become(world: World) -> None:
    world.server()
    handle = world.client().send(Goal(1))
    goal = world.next()
    with pytest.raises(UsageError, match="is executing: it cannot become canceled"):
        goal.canceled()
    with pytest.raises(EncodeError):
        goal.succeed(Result(["x"]))  # type: ignore[list-item]
    assert not goal.done
    goal.succeed()
    with pytest.raises(UsageError, match="is succeeded"):
        goal.abort()
    assert handle.wait(TIMEOUT) is GoalState.SUCCEEDED


def test_rejected_goals(world: World) -> None:
    def choose(goal: Any) -> bool:
        if goal.order == 13:
            raise ValueError("unlucky")
        return bool(goal.order < 10)

    world.server(lambda goal: goal.succeed(), goal=choose)
    client = world.client()
    for order in (10, 13):
        with pytest.raises(GoalRejected, match="'/fib' rejected the goal"):
            client.send(Goal(order))
    assert client.send(Goal(9)).wait(TIMEOUT) is GoalState.SUCCEEDED
    assert client.goals == []


def test_an_execution_that_raises_or_forgets_to_end_aborts(world: World) -> None:
    def execute(goal: ServerGoal) -> None:
        if goal.request.order:
            raise ValueError("broken")

    world.server(execute)
    client = world.client()
    for order in (0, 1):
        with pytest.raises(GoalFailed, match="was aborted"):
            client.send(Goal(order)).result(TIMEOUT)


def test_refused_cancellation(world: World) -> None:
    world.server(cancel=lambda goal: goal.request.order == 1)
    client = world.client()
    first, second = client.send(Goal(1)), client.send(Goal(2))
    goals = {goal.request.order: goal for goal in (world.next(), world.next())}
    assert not second.cancel()
    assert not goals[2].cancel_requested
    assert first.cancel()
    goals[1].canceled()
    goals[2].succeed()
    assert second.wait(TIMEOUT) is GoalState.SUCCEEDED
    assert first.wait(TIMEOUT) is GoalState.CANCELED


def test_codes_of_cancellation(world: World) -> None:
    server = world.server()
    client = world.client()

    def cancel(goal_id: bytes = bytes(16), stamp: int = 0) -> tuple[int, int]:
        info = GoalInfo(UUID(goal_id), Time.from_nsec(stamp))
        response = client.request_cancel(info, TIMEOUT)
        return response.return_code, len(response.goals_canceling)

    codes = CancelGoal.Response
    assert cancel() == (codes.ERROR_NONE, 0)
    assert cancel(b"x" * 16) == (codes.ERROR_UNKNOWN_GOAL_ID, 0)
    handles = [client.send(Goal(order)) for order in range(4)]
    goals = {goal.id: goal for goal in (world.next() for _ in handles)}
    goals[handles[3].id].succeed()
    assert cancel(handles[3].id.bytes) == (codes.ERROR_GOAL_TERMINATED, 0)
    assert cancel(stamp=handles[0].accepted) == (codes.ERROR_NONE, 1)
    assert cancel(handles[2].id.bytes, handles[0].accepted) == (codes.ERROR_NONE, 2)
    assert not goals[handles[1].id].cancel_requested
    assert client.cancel_all() == 3
    for goal in server.goals:
        goal.canceled()
    assert {handle.wait(TIMEOUT) for handle in handles[:3]} == {GoalState.CANCELED}


def test_one_goal_after_the_other(world: World) -> None:
    world.server(policy="queue")
    client = world.client()
    first, second, third = (client.send(Goal(order)) for order in range(3))
    goal = world.next()
    assert goal.id == first.id
    assert third.status is GoalState.ACCEPTED
    assert second.cancel()  # before its turn
    assert second.wait(TIMEOUT) is GoalState.CANCELED
    goal.succeed()
    goal = world.next()
    assert goal.id == third.id
    goal.succeed()
    assert third.wait(TIMEOUT) is GoalState.SUCCEEDED


def test_a_goal_may_be_cancelled_before_it_is_executed(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(action_server, "_MOST_AT_ONCE", 1)
    world.server()
    client = world.client()
    client.send(Goal(1))
    first = world.next()
    handle = client.send(Goal(2))
    assert handle.cancel()
    first.succeed()
    second = world.next()  # its function decides on the result, as in rclpy
    assert second.cancel_requested
    second.canceled(Result([7]))
    with pytest.raises(GoalFailed, match="was canceled") as failed:
        handle.result(TIMEOUT)
    assert list(failed.value.result.sequence) == [7]


def test_a_newer_goal_preempts(world: World) -> None:
    world.server(policy="preempt")
    client = world.client()
    first = client.send(Goal(1))
    goal = world.next()
    assert not goal.cancel_requested
    second = client.send(Goal(2))
    assert goal.wait_for_cancel(TIMEOUT)
    third = client.send(Goal(3))
    assert second.wait(TIMEOUT) is GoalState.CANCELED
    goal.canceled()
    assert first.wait(TIMEOUT) is GoalState.CANCELED
    goal = world.next()
    assert goal.id == third.id
    goal.succeed()
    assert third.wait(TIMEOUT) is GoalState.SUCCEEDED


def test_a_goal_that_is_sent_twice_is_executed_once(world: World) -> None:
    server = world.server()
    client = world.client()
    call = world.client_node.client("fib/_action/send_goal", Fibonacci.SendGoal)
    request = Fibonacci.SendGoal.Request(UUID(b"y" * 16), Goal(1))
    stamps = [call(request).stamp for _ in range(3)]
    assert stamps == stamps[:1] * 3
    assert len(server.goals) == 1
    world.next().succeed()
    assert call(request).stamp == stamps[0]
    assert server.goals == []
    assert world.started.empty()
    del client


def test_results_for_late_askers(world: World) -> None:
    world.server(lambda goal: goal.succeed(Result([goal.request.order])), most_results=2)
    client = world.client()
    handles = []
    for order in range(4):  # in turn: the client asks for a result while the server still has it
        handles.append(client.send(Goal(order)))
        handles[-1].wait(TIMEOUT)
    late = world.client_node.client("fib/_action/get_result", Fibonacci.GetResult)

    def ask(goal_id: bytes) -> tuple[int, list[int]]:
        response = late(Fibonacci.GetResult.Request(UUID(goal_id)))
        return response.status, list(response.result.sequence)

    succeeded = GoalState.SUCCEEDED
    answers = [ask(handle.id.bytes) for handle in handles]
    assert answers == [(0, []), (0, []), (succeeded, [2]), (succeeded, [3])]


def test_results_are_forgotten_in_time(world: World) -> None:
    world.server(lambda goal: goal.succeed(), keep_results=0.0)
    handle = world.client().send(Goal(1))
    with suppress(ActionError):  # it may be forgotten before it is asked for
        handle.wait(TIMEOUT)
    late = world.client_node.client("fib/_action/get_result", Fibonacci.GetResult)
    assert late(Fibonacci.GetResult.Request(UUID(handle.id.bytes))).status == GoalState.UNKNOWN


def test_a_server_that_closes_tells_those_who_wait(world: World) -> None:
    def execute(goal: ServerGoal) -> None:
        world.started.put(goal)
        goal.wait_for_cancel(TIMEOUT)

    server = world.server(execute)
    handles = [world.client().send(Goal(order)) for order in range(2)]
    goals = [world.next() for _ in handles]
    server.close()
    for handle in handles:
        with pytest.raises(ActionError, match=r"the server (of action '/fib' ends|ended)"):
            handle.result(TIMEOUT)
    assert all(goal.cancel_requested for goal in goals)
    goals[0].succeed()  # too late, and not an error


SERVER = """
    import rosz, threading
    from rosz.msgs.example_interfaces.action import Fibonacci

    def execute(goal):
        print("started", flush=True)
        threading.Event().wait()

    with rosz.Node("server") as node:
        node.action_server("fib", Fibonacci, execute)
        print("ready", flush=True)
        threading.Event().wait()
"""


def test_a_killed_server_is_noticed_at_once(world: World) -> None:
    program = world.network.program(SERVER)
    program.wait_for("ready")
    client = world.client()
    handles = [client.send(Goal(order)) for order in range(3)]
    program.kill()
    for handle in handles:
        with pytest.raises(ActionError, match="the server ended before it answered"):
            handle.result(TIMEOUT)  # the link is not given up before
    with pytest.raises(ServiceError):
        handles[0].cancel()


def test_a_server_that_does_not_answer(world: World) -> None:
    program = world.network.program(SERVER)
    program.wait_for("ready")
    client = world.client()
    texts: SimpleQueue[str] = SimpleQueue()

    def keep(record: logging.LogRecord) -> bool:
        texts.put(record.getMessage())
        return True

    world.client_node.log.addFilter(keep)
    handle = client.send(Goal(1))
    assert client.silence == 0.0
    program.process.send_signal(signal.SIGSTOP)
    with pytest.raises(ServerSilent, match="has not answered for"):
        handle.wait(TIMEOUT, silence=2.0)
    with pytest.raises(WaitTimeout, match="the server has not answered for"):
        handle.wait(0.01)
    assert not handle.done
    program.process.send_signal(signal.SIGCONT)
    eventually(lambda: client.silence == 0.0, "an answer of the server")
    for part in ("is stopped: let it go on with 'fg'", "answers again"):
        while part not in texts.get(timeout=TIMEOUT):
            pass
    program.kill()
    with pytest.raises(ActionError, match="is lost"):
        handle.wait(TIMEOUT, silence=TIMEOUT)


def test_a_result_is_asked_for_again_when_the_server_answers(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Zenoh ends the query as it gives a link up, and never ends one that comes at that moment."""
    world.server(lambda goal: goal.succeed(Result([goal.request.order])))
    client = world.client()
    watch, results = client._watch, client._clients[RESULT]
    ask, silences = results.call, []

    def call(request: Any, timeout: float) -> Any:
        silences.append(watch.silence)
        if len(silences) > 1:
            return ask(request, timeout)
        watch._heard, watch._silent = time.monotonic() - 2.0, True
        raise ServiceError("the link is given up")

    monkeypatch.setattr(results, "call", call)
    assert client.send(Goal(7)).result(TIMEOUT).sequence[0] == 7
    assert silences == [0.0, 0.0]


def test_nobody_serves_the_action(world: World) -> None:
    client = world.client_node.action_client("fob", Fibonacci)
    with pytest.raises(ServiceNotFound, match="action '/fob' is not available"):
        client.send(Goal(1))
    with pytest.raises(WaitTimeout, match="server of action '/fob'"):
        client.wait_for_server(0.01)
    assert not client.is_served()


def test_leaving_a_with_block_cancels(world: World) -> None:
    world.server()
    with world.client() as client:
        with client.send(Goal(1)):
            goal = world.next()
        assert goal.wait_for_cancel(TIMEOUT)
        goal.canceled()
        client.send(Goal(2))
        goal = world.next()
    assert goal.wait_for_cancel(TIMEOUT)
    goal.canceled()


def test_calls_from_callbacks(world: World) -> None:
    """Send goals and wait for them in every callback that there is."""
    inner = world.server_node.action_server("inner", Fibonacci, lambda goal: goal.succeed())
    within = world.server_node.action_client("inner", Fibonacci)
    within.wait_for_server(TIMEOUT)

    def ask(_: object) -> bool:
        return within.send(Goal(1)).wait(TIMEOUT) is GoalState.SUCCEEDED

    def execute(goal: ServerGoal) -> None:
        goal.feedback(Feedback([int(ask(goal))]))
        assert goal.wait_for_cancel(TIMEOUT)
        goal.canceled()

    world.server(execute, goal=ask, cancel=ask)
    done: SimpleQueue[bool] = SimpleQueue()

    def end(_: ClientGoal) -> None:
        done.put(client.send(Goal(2)).cancel() or True)

    seen: SimpleQueue[Any] = SimpleQueue()
    client = world.client()
    handle = client.send(Goal(1), feedback=seen.put)
    handle.on_done(end)
    assert list(seen.get(timeout=TIMEOUT).sequence) == [1]
    assert handle.cancel()
    assert handle.wait(TIMEOUT) is GoalState.CANCELED
    assert done.get(timeout=TIMEOUT)
    client.cancel_all()
    del inner


def test_keys_and_states_as_ros_2_has_them(world: World) -> None:
    world.server()
    tokens = {
        token.name: (token.kind.value, token.type_name, token.qos)
        for token in world.server_node.context.graph.refresh().tokens
        if "_action" in token.name
    }
    kinds = {name.rpartition("/")[2]: kind for name, (kind, _, _) in tokens.items()}
    assert kinds == {
        "send_goal": "SS",
        "cancel_goal": "SS",
        "get_result": "SS",
        "feedback": "MP",
        "status": "MP",
    }
    action = "example_interfaces/action/Fibonacci"
    assert tokens["/fib/_action/send_goal"][1] == f"{action}_SendGoal"
    assert tokens["/fib/_action/status"][1:] == ("action_msgs/msg/GoalStatusArray", LATCHED)
    client = world.client()
    handle = client.send(Goal(1))
    goal = world.next()
    seen: SimpleQueue[GoalStatusArray] = SimpleQueue()
    world.client_node.subscription("fib/_action/status", GoalStatusArray, seen.put, qos=LATCHED)
    latest = seen.get(timeout=TIMEOUT).status_list  # a late subscription gets the last one
    assert [bytes(one.goal_info.goal_id.uuid) for one in latest] == [handle.id.bytes]
    goal.succeed()
    handle.wait(TIMEOUT)


def test_policies_are_checked(world: World) -> None:
    with pytest.raises(UsageError, match="expected 'parallel', 'queue' or 'preempt'"):
        world.server(policy="latest")
