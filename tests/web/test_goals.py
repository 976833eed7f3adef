"""Goals that pages send, without pages: by both protocols, followed, and canceled."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.access import PagePolicy
from rosz.actions import ActionlibServer
from rosz.errors import ActionError, EncodeError, NotFoundError, UsageError
from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.web.model import ActionRow, Actions, System
from rosz.web.model.actions import SentGoal


class Robot:
    """A robot with an action of each protocol, whose goals go on as far as a test lets them."""

    def __init__(self, network: Network) -> None:
        self.node = node = network.node("robot")
        self.go_on = threading.Event()
        node.action_server("fib", Fibonacci, self._execute, goal=lambda goal: goal.order < 50)
        message = node.context.types.message
        self._feedback = message("actionlib_tutorials/FibonacciFeedback")
        self._result = message("actionlib_tutorials/FibonacciResult")
        action = message("actionlib_tutorials/FibonacciAction")
        server = ActionlibServer(node, "old", action, self._receive, self._cancel, has_ros2=False)
        server.start()

    def _execute(self, goal: Any) -> None:
        goal.feedback(Fibonacci.Feedback([0, 1]))
        while not self.go_on.is_set():
            if goal.wait_for_cancel(0.02):
                goal.canceled(Fibonacci.Result([0]))
                return
        goal.succeed(Fibonacci.Result([0, 1, 1]))

    def _receive(self, goal: Any) -> None:
        goal.accept()
        goal.publish_feedback(self._feedback(sequence=[0, 1]))
        threading.Thread(target=self._end_later, args=(goal,), daemon=True).start()

    def _end_later(self, goal: Any) -> None:
        while goal.status.status == GoalStatus.ACTIVE:
            if self.go_on.wait(0.02):
                goal.succeed(self._result(sequence=[0, 1, 1]))

    def _cancel(self, goal: Any) -> None:
        goal.cancel(self._result(sequence=[0]))


@pytest.fixture
def robot(network: Network) -> Robot:
    return Robot(network)


class Page:
    """The actions as a page uses them."""

    def __init__(self, network: Network, **permission: Any) -> None:
        node = network.node("page")
        self._system = System(node, PagePolicy(**permission))
        self._graph = self._system.graph.use()
        self.actions: Actions = self._system.actions
        eventually(lambda: len(self.rows()) == 2, "both actions")

    def rows(self) -> list[ActionRow]:
        return self.actions.rows(self._graph.value.survey().view)

    def send(self, name: str, text: str) -> SentGoal:
        return self.actions.send(self._graph.value.survey().view, name, text)

    def cancel(self, name: str, goal_id: str = "") -> str:
        return self.actions.cancel(self._graph.value.survey().view, name, goal_id)

    def use(self, name: str) -> Any:
        return self.actions.use(self._graph.value.survey().view, name)

    def is_used(self) -> bool:
        """Return whether pages or goals use a client of an action."""
        return any(port._users for port in self.actions._ports.values())


BOTH = pytest.mark.parametrize(
    ("name", "canceled"), [("/fib", "canceled"), ("/old", "preempted")], ids=["ros2", "actionlib"]
)


@pytest.fixture
def page(network: Network, robot: Robot) -> Page:
    assert robot
    return Page(network)


def test_actions_of_both_protocols_are_listed(page: Page) -> None:
    assert page.rows() == [
        ActionRow("/fib", "example_interfaces/Fibonacci", ("/robot",), "ROS 2"),
        ActionRow("/old", "actionlib_tutorials/Fibonacci", ("/robot",), "actionlib"),
    ]


@BOTH
def test_a_goal_is_followed_to_its_result(
    page: Page, robot: Robot, name: str, canceled: str
) -> None:
    assert canceled
    goal = page.send(name, "order: 3")
    eventually(lambda: goal.feedbacks == 1, "the feedback")
    assert not goal.done
    robot.go_on.set()
    eventually(lambda: goal.done, "the end of the goal")
    assert (goal.state, goal.fault) == ("succeeded", "")
    assert goal.result == "sequence: [0, 1, 1]"
    assert goal.feedback() == [(1, "sequence: [0, 1]")]
    assert page.actions.goals(name) == [goal]
    eventually(lambda: not page.is_used(), "no client is left")


@BOTH
def test_one_goal_is_canceled_and_all_are(page: Page, name: str, canceled: str) -> None:
    first, second = page.send(name, "order: 3"), page.send(name, "{}")
    use = page.use(name)

    def states() -> list[str]:
        return sorted(one.state for one in use.value.rows() if one.running)

    eventually(lambda: len(states()) == 2, "both goals in the status of the server")
    assert "cancel" in page.cancel(name, first.id)
    eventually(lambda: first.done, "the end of the first goal")
    assert (first.state, first.result) == (canceled, "sequence: [0]")
    assert not second.done
    page.cancel(name)
    eventually(lambda: second.done, "the end of the second goal")
    assert second.state == canceled
    eventually(lambda: not states(), "no goal is left")
    use.close()


def test_what_does_not_work_is_said(page: Page, robot: Robot) -> None:
    with pytest.raises(NotFoundError, match="no node serves action '/none'"):
        page.send("/none", "")
    with pytest.raises(EncodeError, match="order"):
        page.send("/fib", "order: many")
    with pytest.raises(UsageError, match="is not YAML"):
        page.send("/fib", "order: [")
    with pytest.raises(ActionError, match="rejected the goal"):
        page.send("/fib", "order: 70")
    robot.go_on.set()
    goal = page.send("/fib", "")
    eventually(lambda: goal.done, "the end of the goal")
    with pytest.raises(ActionError, match="does not cancel the goal"):
        page.cancel("/fib", goal.id)
    eventually(lambda: not page.is_used(), "no client is left")


def test_a_page_that_is_read_only_sends_no_goal(network: Network, robot: Robot) -> None:
    page = Page(network, read_only=True)
    for action in (lambda: page.send("/fib", ""), lambda: page.cancel("/fib")):
        call: Callable[[], object] = action
        with pytest.raises(UsageError, match="read-only: it may not call '/fib'"):
            call()
    assert robot.node


def test_a_goal_whose_server_ends_is_lost(network: Network) -> None:
    server = network.program(
        """
import rosz
from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.msgs.example_interfaces.action import Fibonacci
with rosz.Node("robot") as node:
    node.action_server("fib", Fibonacci, lambda goal: goal.wait_for_cancel(3600))
    print("ready", flush=True)
    node.spin()
"""
    )
    server.wait_for("ready", TIMEOUT)
    system = System(network.node("page"), PagePolicy())
    graph = system.graph.use().value
    eventually(lambda: system.actions.rows(graph.survey().view), "the action")
    goal = system.actions.send(graph.survey().view, "/fib", "")
    server.kill()
    eventually(lambda: goal.done, "the end of the goal")
    assert goal.state == "lost"
    assert goal.fault


def test_feedback_is_bounded() -> None:
    goal = SentGoal("/fib", "", lambda _: None)
    for number in range(100):
        goal.add_feedback(Fibonacci.Feedback([number]))
    assert goal.feedbacks == 100
    assert [number for number, _ in goal.feedback()] == list(range(100, 80, -1))
    assert goal.feedback()[0][1] == "sequence: [99]"
    goal.add_feedback(Fibonacci.Feedback(list(range(400_000))))
    assert len(goal.feedback()) == 1
    assert len(goal.feedback()[0][1]) < 5000
