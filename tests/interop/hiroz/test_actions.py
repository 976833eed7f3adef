"""Actions in both directions: feedback, results, rejection, cancelling, aborting."""

from __future__ import annotations

import pytest
from network import TIMEOUT

from rosz.actions import ActionClient, GoalState, ServerGoal
from rosz.errors import GoalFailed, GoalRejected
from rosz.msgs.action_tutorials_interfaces.action import Fibonacci

from .city import City, Peer

SEQUENCE = [0, 1, 1, 2, 3, 5]
FEEDBACK = [SEQUENCE[:length] for length in range(3, 7)]
ENDLESS = 100
"""An order with which a goal goes on until it is cancelled."""


@pytest.fixture
def client(city: City, peer: Peer) -> ActionClient:
    """A client of hiroz' server."""
    peer.do("act", "/fibonacci")
    made = city.node("client").action_client("fibonacci", Fibonacci)
    made.wait_for_server(TIMEOUT)
    return made


def test_goals_of_its_server(client: ActionClient) -> None:
    goal = client.send(Fibonacci.Goal(5), timeout=TIMEOUT)
    assert [*goal.result(TIMEOUT).sequence] == SEQUENCE
    assert goal.status is GoalState.SUCCEEDED
    with pytest.raises(GoalRejected):
        client.send(Fibonacci.Goal(-1), timeout=TIMEOUT)
    aborted = client.send(Fibonacci.Goal(0), timeout=TIMEOUT)
    with pytest.raises(GoalFailed, match="aborted"):
        aborted.result(TIMEOUT)


def test_cancelling_at_its_server(client: ActionClient) -> None:
    goal = client.send(Fibonacci.Goal(ENDLESS), timeout=TIMEOUT)
    feedback = iter(goal)
    assert [*next(feedback).partial_sequence] == FEEDBACK[0]
    assert goal.cancel(TIMEOUT)
    assert goal.wait(TIMEOUT) is GoalState.CANCELED
    with pytest.raises(GoalFailed, match="canceled") as failed:
        goal.result(TIMEOUT)
    assert [*failed.value.result.sequence][:6] == SEQUENCE


def test_goals_of_its_client(city: City, peer: Peer) -> None:
    def execute(goal: ServerGoal) -> None:
        sequence = [0, 1]
        if goal.request.order == 0:
            goal.abort(Fibonacci.Result(sequence))
            return
        for _ in range(min(goal.request.order, 5) - 1):
            sequence.append(sum(sequence[-2:]))
            goal.feedback(Fibonacci.Feedback(sequence))
        if goal.request.order < ENDLESS:
            goal.succeed(Fibonacci.Result(sequence))
        else:
            assert goal.wait_for_cancel(TIMEOUT)
            goal.canceled(Fibonacci.Result(sequence))

    node = city.node("server")
    node.action_server("fibonacci", Fibonacci, execute, goal=lambda goal: goal.order >= 0)
    peer.do("send_goal", "/fibonacci", 5)
    peer.next("accepted /fibonacci")
    assert [peer.next("feedback /fibonacci") for _ in FEEDBACK] == FEEDBACK
    assert peer.next("result /fibonacci") == ["Succeeded", {"Ok": SEQUENCE}]
    assert "rejected" in peer.ask("rejected /fibonacci", "send_goal", "/fibonacci", -1)
    peer.do("send_goal", "/fibonacci", 0)
    assert peer.next("result /fibonacci") == ["Aborted", {"Ok": [0, 1]}]
    peer.do("send_goal", "/fibonacci", ENDLESS)
    assert peer.ask("canceling /fibonacci", "cancel", "/fibonacci") == 0
    assert peer.next("result /fibonacci") == ["Canceled", {"Ok": SEQUENCE}]
