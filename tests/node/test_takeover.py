"""Two nodes of one name: the older shuts down and says why."""

from __future__ import annotations

import threading
import time
from queue import SimpleQueue
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from network import TIMEOUT, Network, eventually

from rosz.graph import Followed
from rosz.msgs.std_msgs.msg import String
from rosz.node import Node, control, core
from rosz.node.control import NodeInfo
from rosz.session import Query, Reply
from rosz.wire import ProcessToken, format_process

LOSER = """
    import rosz
    from rosz.msgs.std_msgs.msg import String

    with rosz.Node("king") as node:
        node.publisher("reign", String)
        node.on_shutdown(lambda reason: print("because:", reason, flush=True))
        print("ready", flush=True)
        node.spin()
"""


def takeovers() -> set[threading.Thread]:
    """Return the threads that compare nodes with others of their names."""
    return {t for t in threading.enumerate() if t.name.startswith("rosz-takeover")}


def test_older_process_ends(network: Network) -> None:
    program = network.program(LOSER)
    program.wait_for("ready")
    king = network.node("king")
    assert program.exit_code() == 0
    assert "because: new node registered with same name" in program.lines
    warning = program.wait_for("shutdown request")
    by = f"(process {king.process.pid} on {king.process.host})"
    reason = "new node registered with same name"
    assert warning.endswith(f"shutdown request: [/king] Reason: {reason} {by}")
    assert not king.is_shutdown
    graph = king.context.graph
    graph.wait_for(lambda view: view.nodes() == ["/king"], TIMEOUT, "one king")


def test_only_that_node_ends(network: Network) -> None:
    """The other nodes of its context go on, with all that they declared."""
    context = network.context()
    old, neighbour = Node("king", context=context), Node("queen", context=context)
    subscription = neighbour.subscription("reign", String)
    network.node("king")
    eventually(lambda: old.is_shutdown, "the older one is shut down")
    assert not neighbour.is_shutdown
    neighbour.publisher("reign", String).publish("long live")
    assert subscription.get().data == "long live"


def test_in_one_context(network: Network) -> None:
    context = network.context()
    old = Node("king", context=context)
    new = Node("king", context=context)
    eventually(lambda: old.is_shutdown, "the older one is shut down")
    assert not new.is_shutdown


def test_same_base_name_elsewhere_is_another_node(network: Network) -> None:
    before = takeovers()
    nodes = [
        network.node("king"),
        network.node("king", namespace="/north"),
        network.node("king", context=network.context(domain=7)),
    ]
    seen = threading.Event()
    nodes[0].context.graph.listen(
        lambda other, _: seen.set() if other.node_name == "/last" else None
    )
    network.node("last")
    assert seen.wait(TIMEOUT)  # listeners are called in order: the king has seen all the others
    assert not takeovers() - before
    assert not any(node.is_shutdown for node in nodes)


def test_age_counts_and_not_the_clock(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """A newer node takes over, though the clock of its machine is behind."""
    monkeypatch.setattr(control, "_REPLY_TIMEOUT", TIMEOUT)  # without a reply, the clock counts
    with monkeypatch.context() as earlier:
        clock = SimpleNamespace(monotonic=lambda: time.monotonic() - 10, time_ns=time.time_ns)
        earlier.setattr(core, "time", clock)
        old = network.node("king")
    real = time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: real() - 3600 * 10**9)
    new = network.node("king")
    eventually(lambda: old.is_shutdown, "the older one is shut down")
    assert not new.is_shutdown


def test_a_newer_node_does_not_follow_the_older_into_its_end(network: Network) -> None:
    """The clock of its machine is behind, and the older one, which has ended, does not respond."""
    king, elsewhere = network.node("king"), network.session()
    namesakes = king.context.graph.follow_processes("/king")
    later = king.process.started + 3600 * 10**9
    old = ProcessToken(king.context.domain, elsewhere.zid, 1, later, 7, "afar", "/king")
    assert not control._is_newer(king, namesakes, old)
    token = elsewhere.token(format_process(old))
    eventually(lambda: king.is_shutdown, "the end, as the time in the token of the other counts")
    token.close()
    namesakes.close()


def test_a_node_that_queries_reach_later_than_its_token_arrives(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is newer, though the clock of its machine is behind."""
    monkeypatch.setattr(control, "_ATTEMPTS", 10**9)
    king, elsewhere = network.node("king"), network.session()
    asked = threading.Event()
    get = king.context.session.get

    def note(key: str, **options: Any) -> list[Reply]:
        replies = get(key, **options)
        asked.set()
        return replies

    monkeypatch.setattr(king.context.session, "get", note)
    earlier = king.process.started - 3600 * 10**9
    new = ProcessToken(king.context.domain, elsewhere.zid, 1, earlier, 7, "afar", "/king")
    token = elsewhere.token(format_process(new))
    assert asked.wait(TIMEOUT)
    assert not king.is_shutdown
    key = control.control_key(new.domain, new.zid, new.node_id)
    info = NodeInfo("/king", 7, "afar", [], earlier, age=-10.0)

    def respond(query: Query) -> None:
        with query:
            query.reply(key, msgspec.msgpack.encode(info))

    queryable = elsewhere.queryable(key, respond)
    eventually(lambda: king.is_shutdown, "the older one is shut down")
    queryable.close()
    token.close()


def test_a_chain_of_successors(network: Network) -> None:
    kings = [network.node("king") for _ in range(5)]
    eventually(lambda: [k.is_shutdown for k in kings] == [True] * 4 + [False], "one is left")


def test_anonymous_nodes_do_not_collide(network: Network) -> None:
    nodes = [network.node("king", anonymous=True) for _ in range(3)]
    assert len({node.name for node in nodes}) == 3


def test_duplicates_take_few_threads(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    go_on = threading.Event()
    asked: SimpleQueue[int] = SimpleQueue()

    def slowly(_node: Node, _namesakes: Followed, other: ProcessToken) -> bool:
        asked.put(other.node_id)
        assert go_on.wait(TIMEOUT)
        return False

    monkeypatch.setattr(control, "_is_newer", slowly)
    king = network.node("king")
    elsewhere = network.context()
    ended = takeovers()
    duplicates = [
        ProcessToken(king.context.domain, elsewhere.session.zid, number, 1, 7, "afar", "/king")
        for number in range(50)
    ]
    tokens = [elsewhere.session.token(format_process(duplicate)) for duplicate in duplicates]
    seen = [asked.get(timeout=TIMEOUT) for _ in range(control._THREADS)]
    network.node("last")
    king.context.graph.wait_for_node("/last", TIMEOUT)
    assert len(takeovers() - ended) == control._THREADS
    go_on.set()
    seen += [asked.get(timeout=TIMEOUT) for _ in range(len(duplicates) - len(seen))]
    assert sorted(seen) == list(range(len(duplicates)))
    assert not king.is_shutdown
    for token in tokens:
        token.close()
