"""What commands look for once is found, though a query ended before all had replied to it."""

from __future__ import annotations

import pytest
from network import TIMEOUT, Network, eventually

from rosz.actions import ServerGoal, view_of_action
from rosz.errors import NotFoundError
from rosz.graph import Graph, View
from rosz.introspect.services import find_server, wait_for_server
from rosz.introspect.subscribe import wait_for_target
from rosz.introspect.survey import take_survey
from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import Empty
from rosz.node import Context, Node
from rosz.session import Session

SEND = """
    import sys
    from rosz.cli.main import run
    from rosz.graph import Graph, View

    Graph.refresh = lambda *_: View(())
    sys.exit(run(["action", "send", "--wait", "/count", "{order: 3}"]))
"""


@pytest.fixture
def context(network: Network, monkeypatch: pytest.MonkeyPatch) -> Context:
    """A context that knows a topic, a service and an action, and whose queries find nothing."""
    robot = network.node("robot")
    robot.publisher("scan", String)
    robot.service("reset", Empty, lambda _: None)
    robot.action_server("count", Fibonacci, lambda _: None)
    made = network.context()

    def is_known() -> bool:
        view = made.graph.view()
        servers = view.servers("/reset") and view.servers("/count/_action/send_goal")
        return bool(view.publishers("/scan") and servers)

    eventually(is_known, "what the robot declares")
    monkeypatch.setattr(Graph, "refresh", lambda *_: View(()))
    return made


def test_what_a_query_lacks_is_found(context: Context) -> None:
    assert wait_for_server(context, "/reset", pytest.fail).node_name == "/robot"
    assert view_of_action(context, "/count").nodes() == ["/robot"]
    target, token = wait_for_target(Node("tool", context=context), "/scan", pytest.fail)
    assert (target.topic, token.node_name) == ("/scan", "/robot")


def test_what_is_not_there_is_not_found(context: Context) -> None:
    with pytest.raises(NotFoundError, match="unknown service '/rest'; did you mean '/reset'"):
        context.graph.find(lambda view: find_server(view, "/rest"))


def test_an_action_that_was_waited_for_needs_no_other_query(network: Network) -> None:
    def execute(goal: ServerGoal) -> None:
        goal.succeed(Fibonacci.Result([1, 2]))

    network.node("robot").action_server("count", Fibonacci, execute)
    program = network.program(SEND)
    assert program.exit_code(TIMEOUT) == 0, program.output


def test_nodes_that_reply_late_are_found_by_name(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    context = network.node("robot").context
    asked: list[str] = []
    live_tokens = Session.live_tokens

    def reply_late(session: Session, key: str, timeout: float, looks: int = 1) -> list[str]:
        asked.append(key)
        return [] if len(asked) == 1 else live_tokens(session, key, timeout, looks)

    monkeypatch.setattr(Session, "live_tokens", reply_late)
    survey = take_survey(context.session, context.domain, nodes=["/robot"])
    assert survey.view.nodes() == ["/robot"]
    assert asked[0] == asked[1]
    take_survey(context.session, context.domain, nodes=["/robot"])
    assert len(asked) == 3
