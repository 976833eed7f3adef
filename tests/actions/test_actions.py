"""Actions through the native API: goals, their states and callbacks, over a network."""

from __future__ import annotations

import logging
import signal
import threading
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.actions import (
    ActionlibClient,
    ActionlibClientGoal,
    ActionlibServer,
    ActionTypes,
    SimpleActionServer,
)
from rosz.errors import UsageError
from rosz.msgs.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosz.msgs.std_msgs.msg import String
from rosz.packages import PackageIndex
from rosz.typestore import TypeStore


class Count:
    """The classes of an action that is compiled from its definition."""

    def __init__(self, folder: Path) -> None:
        package = folder / "counting"
        (package / "action").mkdir(parents=True)
        (package / "action" / "Count.action").write_text(
            "int32 top\n---\nint32 sum\n---\nint32 now\n"
        )
        (package / "package.xml").write_text("<package><name>counting</name></package>")
        store = TypeStore(PackageIndex([folder]))
        self.action: Any = store.message("counting/CountAction")
        self.goal: Any = store.message("counting/CountGoal")
        self.result: Any = store.message("counting/CountResult")
        self.feedback: Any = store.message("counting/CountFeedback")


class World:
    """A server that is driven by the test, and a client."""

    def __init__(self, network: Network) -> None:
        self.count = Count(network.folder / "src")
        self.server_node, self.client_node = network.node("server"), network.node("client")

    def server(self, execute: Any = None) -> SimpleActionServer:
        server = SimpleActionServer(
            ActionlibServer(self.server_node, "count", self.count.action), execute
        )
        server.start()
        return server

    def client(self) -> ActionlibClient:
        client = ActionlibClient(self.client_node, "count", self.count.action)
        assert client.wait_for_server(TIMEOUT)
        return client


@pytest.fixture
def world(network: Network) -> World:
    return World(network)


def test_a_goal_from_start_to_end(world: World) -> None:
    count = world.count
    events: list[Any] = []
    received = threading.Event()

    def execute(goal: Any) -> None:
        server.publish_feedback(count.feedback(goal.top))
        assert received.wait(TIMEOUT)  # a result may overtake feedback, which is then ignored
        server.set_succeeded(count.result(goal.top + 1), "counted")

    server = world.server(execute)

    def on_done(goal: ActionlibClientGoal) -> None:
        events.append(("done", goal.status.status, goal.result.sum))

    def on_feedback(feedback: Any) -> None:
        events.append(feedback.now)
        received.set()

    goal = world.client().send(
        count.goal(4),
        on_done=on_done,
        on_active=lambda: events.append("active"),
        on_feedback=on_feedback,
    )
    assert goal.wait(TIMEOUT)
    assert (goal.done, goal.started, goal.status.text) == (True, True, "counted")
    assert sorted(events, key=str) == [("done", GoalStatus.SUCCEEDED, 5), 4, "active"]
    assert not server.is_active()


def test_a_client_follows_several_goals(world: World) -> None:
    server = world.server()
    server.on_goal = server.accept_new_goal
    client = world.client()
    first = client.send(world.count.goal(1))
    second = client.send(world.count.goal(2))
    assert first.wait(TIMEOUT)
    assert first.status.status == GoalStatus.PREEMPTED
    assert not second.done
    server.set_aborted(text="enough")
    assert second.wait(TIMEOUT)
    assert (second.status.status, second.status.text) == (GoalStatus.ABORTED, "enough")
    assert second.result == world.count.result()


def test_a_goal_that_waits_is_recalled_by_a_newer_one(world: World) -> None:
    server = world.server()
    client = world.client()
    first, second = client.send(world.count.goal(1)), client.send(world.count.goal(2))
    assert first.wait(TIMEOUT)
    assert (first.status.status, first.started) == (GoalStatus.RECALLED, False)
    assert server.next_goal.message.goal.top == 2
    assert not second.done


@pytest.mark.parametrize("everything", [False, True])
def test_cancelling(world: World, everything: bool) -> None:
    server = world.server()
    server.on_goal = server.accept_new_goal
    server.on_preempt = lambda: server.set_preempted(world.count.result(7), "stopped")
    client = world.client()
    active = threading.Event()
    goal = client.send(world.count.goal(1), on_active=active.set)
    assert active.wait(TIMEOUT)
    if everything:
        client.publish_cancel(GoalID())
    else:
        goal.cancel()
    assert goal.wait(TIMEOUT)
    assert (goal.status.status, goal.result.sum) == (GoalStatus.PREEMPTED, 7)
    assert server.is_preempt_requested()


def test_a_forgotten_goal_is_not_followed(world: World) -> None:
    server = world.server()
    accepted = threading.Event()
    calls: list[ActionlibClientGoal] = []

    def accept() -> None:
        server.accept_new_goal()
        accepted.set()

    server.on_goal = accept
    client = world.client()
    forgotten = client.send(world.count.goal(1), on_done=calls.append)
    forgotten.forget()
    assert accepted.wait(TIMEOUT)
    server.set_succeeded()
    accepted.clear()
    followed = client.send(world.count.goal(2))
    assert accepted.wait(TIMEOUT)
    server.set_succeeded()
    assert followed.wait(TIMEOUT)
    assert (calls, forgotten.done) == ([], False)


def test_a_goal_unknown_to_a_restarted_server_is_lost(world: World) -> None:
    server = world.server()
    active = threading.Event()
    server.on_goal = server.accept_new_goal
    goal = world.client().send(world.count.goal(1), on_active=active.set)
    assert active.wait(TIMEOUT)
    world.server()  # publishes a status without goals
    assert goal.wait(TIMEOUT)
    assert goal.status.status == GoalStatus.LOST
    assert "does not know" in goal.status.text


SERVER = """
    import threading
    import rosz
    from rosz.actions import ActionlibServer, SimpleActionServer

    with rosz.Node("other") as node:
        action = node.context.types.message("counting/CountAction")
        server = SimpleActionServer(ActionlibServer(node, "count", action))
        server.action_server.on_goal = lambda goal: goal.accept()
        server.start()
        print("ready", flush=True)
        threading.Event().wait()
"""


@pytest.mark.parametrize("stopped", [False, True])
def test_a_server_that_is_killed_or_stopped(network: Network, world: World, stopped: bool) -> None:
    program = network.program(SERVER, ROSZ_PACKAGE_PATH=str(network.folder / "src"))
    program.wait_for("ready")
    active = threading.Event()
    goal = world.client().send(world.count.goal(1), on_active=active.set)
    assert active.wait(TIMEOUT)
    texts: SimpleQueue[str] = SimpleQueue()

    def keep(record: logging.LogRecord) -> bool:
        texts.put(record.getMessage())
        return True

    world.client_node.log.addFilter(keep)
    if stopped:
        program.process.send_signal(signal.SIGSTOP)
        while "let it go on with 'fg'" not in texts.get(timeout=TIMEOUT):
            pass
        assert not goal.done
        program.process.send_signal(signal.SIGCONT)
        while "answers again" not in texts.get(timeout=TIMEOUT):
            pass
        assert not goal.done
    program.kill()
    assert goal.wait(TIMEOUT)
    assert (goal.status.status, goal.status.text) == (GoalStatus.LOST, "the server ended")


def test_a_server_is_ready_once_it_has_published_its_status(world: World) -> None:
    node = world.server_node
    types = ActionTypes.of(world.count.action, node.context.types)
    result = node.publisher("count/result", types.action_result)
    node.publisher("count/feedback", types.action_feedback)
    node.subscription("count/goal", types.action_goal, lambda _: None)
    node.subscription("count/cancel", GoalID, lambda _: None)
    status = node.publisher("count/status", GoalStatusArray)
    client = ActionlibClient(world.client_node, "count", world.count.action)
    for publisher in (status, result):
        publisher.wait_for_subscribers(1, TIMEOUT)
    assert not client.wait_for_server(0.5)
    found: SimpleQueue[bool] = SimpleQueue()
    waiting = threading.Thread(target=lambda: found.put(client.wait_for_server(TIMEOUT)))
    waiting.start()
    status.publish()
    assert found.get()
    waiting.join()
    status.close()
    eventually(lambda: not client.wait_for_server(0.1))  # the status was that of another server


def test_a_late_client_need_not_wait_for_the_next_status(world: World) -> None:
    server = ActionlibServer(world.server_node, "count", world.count.action, status_frequency=0)
    server.start()
    world.client()
    server.stop()


def test_callbacks_that_fail_do_not_stop_a_goal(world: World) -> None:
    def fail(*_: object) -> None:
        raise ValueError("no")

    server = world.server(fail)
    server.on_goal = fail
    goal = world.client().send(world.count.goal(1), on_done=fail, on_active=fail)
    assert goal.wait(TIMEOUT)
    assert goal.status.status == GoalStatus.ABORTED
    assert goal.status.text == "Exception in execute callback: no"


def test_an_execution_without_a_final_state_is_aborted(world: World) -> None:
    world.server(lambda _: None)
    goal = world.client().send(world.count.goal(1))
    assert goal.wait(TIMEOUT)
    assert (goal.status.status, goal.status.text) == (
        GoalStatus.ABORTED,
        "No terminal state was set.",
    )


def test_on_active_returns_before_on_done(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rosz.actions.actionlib_client._ACTIVE_TIMEOUT", TIMEOUT)
    events: list[str] = []
    entered, leave = threading.Event(), threading.Event()

    def on_active() -> None:
        entered.set()
        leave.wait(TIMEOUT)
        events.append("active")

    client = ActionlibClient(world.client_node, "count", world.count.action)
    goal = client.send(
        world.count.goal(1), on_active=on_active, on_done=lambda _: events.append("done")
    )
    running = threading.Thread(target=goal.update, args=([GoalStatus(goal.id, GoalStatus.ACTIVE)],))
    running.start()
    assert entered.wait(TIMEOUT)
    ending = threading.Thread(
        target=goal.finish, args=(GoalStatus(goal.id, GoalStatus.SUCCEEDED), None)
    )
    ending.start()
    leave.set()
    running.join(TIMEOUT)
    assert goal.wait(TIMEOUT)
    assert events == ["active", "done"]


def test_waiting_has_limits(world: World) -> None:
    client = ActionlibClient(world.client_node, "count", world.count.action)
    assert not client.wait_for_server(0.01)
    assert not client.send(world.count.goal(1)).wait(0.01)


def test_only_actions_are_accepted() -> None:
    with pytest.raises(UsageError, match="String is not an action"):
        ActionTypes.of(String, TypeStore())


@pytest.mark.parametrize("quick", [True, False], ids=["quick", "slow"])
def test_on_active_may_wait_for_the_end(world: World, quick: bool) -> None:
    count = world.count
    begun = threading.Event()
    events: list[str] = []

    def execute(_: Any) -> None:
        if not quick:
            assert begun.wait(TIMEOUT)
        server.set_succeeded(count.result(1))

    server = world.server(execute)

    def on_active() -> None:
        begun.set()
        events.append(f"active {sent.get().wait(TIMEOUT)}")

    sent: SimpleQueue[ActionlibClientGoal] = SimpleQueue()
    goal = world.client().send(
        count.goal(1), on_done=lambda _: events.append("done"), on_active=on_active
    )
    sent.put(goal)
    assert goal.wait(TIMEOUT)
    eventually(lambda: sorted(events) == ["active True", "done"], "both callbacks")
