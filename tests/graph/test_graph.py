from __future__ import annotations

import logging
import signal
import threading
from collections.abc import Iterator
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import ClosedError, WaitTimeout
from rosz.graph import Graph, View
from rosz.msgs.std_msgs.msg import Int32, String
from rosz.msgs.std_srvs.srv import Empty
from rosz.node import Context
from rosz.wire import Kind, ProcessToken, Token

VISITOR = """
    import rosz
    from rosz.msgs.std_msgs.msg import String
    from rosz.msgs.std_srvs.srv import Empty

    node = rosz.Node("visitor")
    node.publisher("visit", String)
    node.service("leave", Empty, lambda request: None)
    print("ready")
    node.spin()
"""


@pytest.fixture
def graph(network: Network) -> Iterator[Graph]:
    made = Graph(network.session(), network.domain)
    yield made
    made.close()


def test_nodes_and_entities(network: Network, graph: Graph) -> None:
    node = network.node("robot", namespace="/lab")
    node.publisher("scan", String)
    node.subscription("cmd", Int32)
    node.service("~reset", Empty, lambda _: None)
    node.client("/dock", Empty)
    view = graph.wait_for(
        lambda view: bool(
            view.clients("/dock") and view.publishers("/rosout") and view.processes()
        ),
        TIMEOUT,
        "client",
    )
    assert view.nodes() == ["/lab/robot"]
    assert view.topics() == {
        "/lab/cmd": ["std_msgs/msg/Int32"],
        "/lab/scan": ["std_msgs/msg/String"],
        "/rosout": ["rcl_interfaces/msg/Log"],
    }
    assert view.services() == {"/lab/robot/reset": ["std_srvs/srv/Empty"]}
    (scan,) = view.publishers("/lab/scan")
    assert (scan.node_name, scan.zid) == ("/lab/robot", node.context.session.zid)
    (process,) = view.processes("/lab/robot")
    assert process == node.process


def test_nodes_come_and_go(network: Network, graph: Graph) -> None:
    events: SimpleQueue[tuple[str, bool]] = SimpleQueue()
    graph.listen(lambda token, alive: events.put((token.name or token.node_name, alive)))
    node = network.node("robot")
    assert events.get(timeout=TIMEOUT) == ("/robot", True)
    scan = node.publisher("scan", String)
    seen = {events.get(timeout=TIMEOUT) for _ in range(2)}
    assert seen == {("/scan", True), ("/rosout", True)}
    scan.close()
    assert events.get(timeout=TIMEOUT) == ("/scan", False)
    node.close()
    assert {events.get(timeout=TIMEOUT) for _ in range(2)} == {
        ("/robot", False),
        ("/rosout", False),
    }


def test_a_listener_gets_history_first_until_unregistered(
    network: Network, graph: Graph, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosz.graph.interests.COMPLETE_BY", TIMEOUT)  # history may come late
    network.node("robot")
    graph.wait_for_topic("/rosout", TIMEOUT)
    told: SimpleQueue[str] = SimpleQueue()
    second = threading.Event()
    withdraw = graph.listen(lambda token, _: told.put(token.node_name))
    graph.listen(lambda token, _: second.set() if token.node_name == "/second" else None)
    assert told.get(timeout=TIMEOUT) == "/robot"
    withdraw()
    withdraw()
    network.node("second")
    assert second.wait(TIMEOUT)
    while not told.empty():
        assert told.get() == "/robot"


@pytest.mark.parametrize("kind", [ValueError, SystemExit])
def test_a_failing_listener_does_not_stop_others(
    network: Network,
    graph: Graph,
    caplog: pytest.LogCaptureFixture,
    kind: type[BaseException],
) -> None:
    def fail(token: Token, alive: bool) -> None:
        raise kind(f"no {token.node_name} {alive}")

    after: SimpleQueue[str] = SimpleQueue()
    graph.listen(fail)
    graph.listen(lambda token, _: after.put(token.node_name))
    network.node("robot")
    assert after.get(timeout=TIMEOUT) == "/robot"
    assert f"{kind.__name__}: no /robot True" in caplog.text


def test_a_listener_may_wait_for_the_graph(network: Network, graph: Graph) -> None:
    seen: SimpleQueue[str] = SimpleQueue()

    def listener(token: Token, alive: bool) -> None:
        if token.name == "/scan" and alive:
            graph.wait_for_node("/second", TIMEOUT)
            seen.put("both")

    graph.listen(listener)
    network.node("robot").publisher("scan", String)
    network.node("second")
    assert seen.get(timeout=TIMEOUT) == "both"


def test_order_holds_where_another_listener_waits(network: Network, graph: Graph) -> None:
    waiting = threading.Event()
    told: SimpleQueue[bool] = SimpleQueue()

    def wait(token: Token, alive: bool) -> None:
        if token.name == "/scan" and alive:
            waiting.set()
            graph.wait_for(lambda view: not view.publishers("/scan"), TIMEOUT, "end of '/scan'")
            late.append(graph.listen(listen_late))

    def listen(token: Token, alive: bool) -> None:
        if token.name == "/scan":
            told.put(alive)

    def listen_late(token: Token, alive: bool) -> None:
        late.append((token.name, alive))

    late: list[Any] = []
    graph.listen(wait)
    graph.listen(listen)
    publisher = network.node("robot").publisher("scan", String)
    assert waiting.wait(TIMEOUT)
    publisher.close()
    assert [told.get(timeout=TIMEOUT) for _ in range(2)] == [True, False]
    eventually(lambda: ("/rosout", True) in late, "what is there is told to who comes late")
    assert ("/scan", True) not in late


def test_killed_process_is_gone_at_once(network: Network, graph: Graph) -> None:
    visitor = network.program(VISITOR)
    graph.wait_for_service("/leave", TIMEOUT)
    visitor.kill()
    graph.wait_for(
        lambda view: (
            not ("/visitor" in view.nodes() or view.processes("/visitor") or view.services())
        ),
        TIMEOUT,
        "death",
    )


def test_stopped_process_is_not_gone(network: Network, graph: Graph) -> None:
    """It may resume: a node ends only with its link or its lease."""
    visitor = network.program(VISITOR)
    graph.wait_for_service("/leave", TIMEOUT)
    visitor.send(signal.SIGSTOP)
    network.node("robot")
    graph.wait_for_node("/robot", TIMEOUT)
    eventually(lambda: graph.view().nodes() == ["/robot", "/visitor"], "both nodes")
    visitor.send(signal.SIGCONT)


class TestWaiting:
    def test_for_things_that_come(self, network: Network, graph: Graph) -> None:
        arrived: SimpleQueue[View] = SimpleQueue()
        for wait in (
            lambda: graph.wait_for_node("/robot", TIMEOUT),
            lambda: graph.wait_for_topic("/scan", TIMEOUT),
            lambda: graph.wait_for_service("/reset", TIMEOUT),
            lambda: graph.wait_for_subscribers("/cmd", 2, TIMEOUT),
        ):
            network.thread(lambda wait=wait: arrived.put(wait()))  # type: ignore[misc]
        node = network.node("robot")
        node.publisher("scan", String)
        node.service("reset", Empty, lambda _: None)
        for _ in range(2):
            node.subscription("cmd", Int32)
        for _ in range(4):
            arrived.get(timeout=TIMEOUT)

    def test_near_miss(self, network: Network, graph: Graph) -> None:
        network.node("robot").publisher("scanner", String)
        graph.wait_for_topic("/scanner", TIMEOUT)
        with pytest.raises(
            WaitTimeout,
            match=r"no publisher of '/scaner' within 0\.01 s; did you mean '/scanner'\?",
        ):
            graph.wait_for_topic("/scaner", 0.01)
        with pytest.raises(WaitTimeout, match=r"no node '/robt' .* did you mean '/robot'\?"):
            graph.wait_for_node("/robt", 0.01)

    def test_ends_with_the_graph(self, network: Network, graph: Graph) -> None:
        ended: SimpleQueue[str] = SimpleQueue()
        begun = threading.Event()

        def wait() -> None:
            begun.set()
            try:
                graph.wait_for_node("/never", TIMEOUT)
            except ClosedError as error:
                ended.put(str(error))

        network.thread(wait)
        assert begun.wait(TIMEOUT)
        graph.close()
        graph.close()
        assert ended.get(timeout=TIMEOUT) == "the wait for node '/never' ended: shutting down"
        with pytest.raises(ClosedError):
            graph.wait_for_node("/never", TIMEOUT)


def test_refresh(network: Network) -> None:
    """A graph that has received no token yet can query; ended nodes do not stay in it."""
    node = network.node("robot")
    scan = node.publisher("scan", String)
    context = network.context()
    assert context.mesh.ready.wait(TIMEOUT)
    graph = context.graph
    view = graph.refresh(TIMEOUT)
    assert [token.node_name for token in view.publishers("/scan")] == ["/robot"]
    assert [process.node for process in view.processes()] == ["/robot"]
    scan.close()
    eventually(lambda: not graph.view().publishers("/scan"), "the publisher is gone")
    assert not graph.refresh(TIMEOUT).publishers("/scan")
    graph.close()


def test_domains_are_separate(network: Network, graph: Graph) -> None:
    context = network.context(domain=7)
    network.node("elsewhere", context=context)
    network.node("here")
    graph.wait_for_node("/here", TIMEOUT)
    context.graph.wait_for_node("/elsewhere", TIMEOUT)
    eventually(lambda: graph.view().nodes() == ["/here"], "one node here")
    eventually(lambda: context.graph.view().nodes() == ["/elsewhere"], "one node there")


@pytest.mark.parametrize(
    ("keys", "kind"),
    [
        (["@ros2_lv/42/1/0/0/NN/%", "@ros2_lv/42/1/0/1/NN"], "liveliness token"),
        (["@ros2_lv/42/1/0/0/XX/%/%/a", "@ros2_lv/42/1/x/0/NN/%/%/a"], "liveliness token"),
        (["@ros2_lv/42/1/0/1/MP/%/%/a/%t/String/RIHS01_0/::,10:,:,:,,"], "type chunk"),
        (["@ros2_lv/42/1/0/1/MP/%/%/a/%t/a::msg::dds_::B_/RIHS01_0/:"], "QoS chunk"),
        (["@rosz/42/node/1/x/1/1/h/%a", "@rosz/42/node/1"], "process token"),
    ],
)
def test_damaged_tokens(
    network: Network, graph: Graph, caplog: pytest.LogCaptureFixture, keys: list[str], kind: str
) -> None:
    """Each kind of damage is logged once, and other tokens are handled."""
    session = network.session()
    with caplog.at_level(logging.WARNING, "rosz.graph"):
        tokens = [session.token(key) for key in keys]
        network.node("robot")
        view = graph.wait_for(lambda view: "/robot" in view.nodes(), TIMEOUT, "the node")
        told: list[str] = []

        def is_told() -> bool:
            records = [record for record in caplog.records if record.name == "rosz.graph"]
            told[:] = [record.getMessage() for record in records]
            return bool(told)

        eventually(is_told, "the warning, as the tokens come from another session")
    assert view.nodes() == ["/robot"]
    assert tokens
    assert len(set(told)) == 1
    assert told[0].startswith(f"ignoring foreign tokens with a damaged {kind} (told once): ")
    assert len(told[0]) < 400


def test_a_foreign_token_alone_makes_its_node_known() -> None:
    token = Token(0, "1", 5, 9, Kind.PUBLISHER, "/", "cpp", name="/t")
    assert View([token]).nodes() == ["/cpp"]


def test_two_nodes_of_one_name() -> None:
    tokens = [Token(0, zid, 0, 0, Kind.NODE, "/", "n") for zid in ("1", "2")]
    assert View(tokens).nodes() == ["/n", "/n"]


def test_processes_are_in_the_order_of_their_start() -> None:
    processes = [ProcessToken(0, zid, 0, when, 1, "h", "/n") for zid, when in (("1", 9), ("2", 3))]
    assert [process.started for process in View([], processes).processes("/n")] == [3, 9]


def test_the_first_view_is_complete(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither the first view nor a refreshed one lacks a token, however long that takes."""
    monkeypatch.setattr("rosz.graph.graph.COMPLETE_BY", TIMEOUT)
    monkeypatch.setattr("rosz.graph.interests.COMPLETE_BY", TIMEOUT)
    monkeypatch.setattr(Context, "MESH_TIMEOUT", TIMEOUT)
    host = network.context()
    nodes = [network.node(f"n{number}", context=host) for number in range(100)]
    names = {node.name for node in nodes}
    for _ in range(5):
        context = network.context()
        assert names <= set(context.graph.view().nodes())
        assert names <= set(context.graph.refresh(TIMEOUT).nodes())
        context.close()
