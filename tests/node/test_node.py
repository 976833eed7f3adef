from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from queue import SimpleQueue
from typing import Any

import msgspec
import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import UsageError
from rosz.lifecycle import Registration
from rosz.msgs.rcl_interfaces.msg import Log
from rosz.msgs.std_msgs.msg import String
from rosz.node import Node
from rosz.node.control import NodeInfo, control_key
from rosz.params.replica import Replica
from rosz.qos import ROSOUT
from rosz.session import Session
from rosz.typestore import TypeStore


@pytest.fixture
def node(network: Network) -> Node:
    return network.node("node")


def _raising(error: BaseException) -> Callable[[str], None]:
    def hook(_reason: str) -> None:
        raise error

    return hook


def _count(monkeypatch: pytest.MonkeyPatch, made: SimpleQueue[object]) -> None:
    """Have replicas and type stores counted, each made only when it has met another, or in vain."""
    both = threading.Barrier(2)
    for kind in (Replica, TypeStore):
        begin = kind.__init__

        def init(self: object, *args: Any, begin: Any = begin, **options: Any) -> None:
            made.put(self)
            with suppress(threading.BrokenBarrierError):
                both.wait(0.1)
            begin(self, *args, **options)

        monkeypatch.setattr(kind, "__init__", init)


@pytest.mark.parametrize("error", [ValueError("no"), SystemExit(3)])
def test_a_hook_that_raises_ends_no_other(
    node: Node, capfd: pytest.CaptureFixture[str], error: BaseException
) -> None:
    reasons: list[str] = []
    subscription = node.subscription("chatter", String)
    node.on_shutdown(reasons.append)
    node.on_shutdown(_raising(error))
    node.shutdown("enough")
    assert reasons == ["enough"]
    assert subscription.closed
    assert "a shutdown hook failed" in capfd.readouterr().err


@pytest.mark.parametrize("error", [ValueError("no"), SystemExit(3)])
def test_a_hook_of_the_context_that_raises_ends_no_other(
    network: Network, caplog: pytest.LogCaptureFixture, error: BaseException
) -> None:
    reasons: list[str] = []
    context = network.context()
    context.on_shutdown(reasons.append)
    context.on_shutdown(_raising(error))
    context.shutdown("enough")
    assert reasons == ["enough"]
    assert context.closed
    assert context.session.closed
    assert "a shutdown hook failed" in caplog.text


def test_ctrl_c_in_a_hook_arrives_after_all_is_closed(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in network.variables().items():
        monkeypatch.setenv(name, value)
    node = Node("node", argv=(), handle_signals=False)
    subscription = node.subscription("chatter", String)
    node.on_shutdown(_raising(KeyboardInterrupt()))
    with pytest.raises(KeyboardInterrupt):
        node.close()
    assert subscription.closed
    assert node.context.session.closed


def test_ctrl_c_in_a_hook_of_the_context_arrives_after_all_is_closed(network: Network) -> None:
    context = network.context()
    context.on_shutdown(_raising(KeyboardInterrupt()))
    with pytest.raises(KeyboardInterrupt):
        context.close()
    assert context.closed
    assert context.session.closed


def test_a_context_that_cannot_begin_leaves_no_session(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    sessions: list[Session] = []

    def interrupt(session: Session, _domain: int) -> None:
        sessions.append(session)
        raise KeyboardInterrupt

    monkeypatch.setattr("rosz.node.context.Graph", interrupt)
    with pytest.raises(KeyboardInterrupt):
        network.context()
    assert sessions[0].closed


def test_a_hook_may_set_parameters(network: Network, node: Node) -> None:
    other = network.node("other")
    other.params["/left"] = False
    node.on_shutdown(lambda _: node.params.set("/left", True))
    node.context.shutdown()
    assert other.params["/left"] is True


@pytest.mark.parametrize("name", ["params", "types"])
def test_all_threads_share_one(
    network: Network, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Also where the second asks while the first is still at making it."""
    context = network.context()
    made: SimpleQueue[object] = SimpleQueue()
    _count(monkeypatch, made)
    threads = [network.thread(lambda: getattr(context, name)) for _ in range(2)]
    for thread in threads:
        thread.join(TIMEOUT)
    assert made.qsize() == 1


def test_contexts_join_the_store_side_by_side(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    contexts = [network.context() for _ in range(2)]
    together = threading.Barrier(2)
    joined: SimpleQueue[object] = SimpleQueue()

    class Joining(Replica):
        def __init__(self, *args: Any, **options: Any) -> None:
            together.wait(TIMEOUT)
            super().__init__(*args, **options)

    monkeypatch.setattr("rosz.params.replica.Replica", Joining)
    for name, context in zip(("one", "two"), contexts, strict=True):
        # Reading /use_sim_time joins.
        network.thread(lambda n=name, c=context: joined.put(Node(n, context=c)))  # type: ignore[misc]
    for _ in contexts:
        joined.get(timeout=TIMEOUT)


def test_a_hook_that_comes_late_is_called_at_once(node: Node) -> None:
    reasons: list[str] = []
    node.shutdown("enough")
    node.on_shutdown(reasons.append)
    assert len(reasons) == 1


def test_a_part_that_cannot_be_closed_keeps_no_other_open(
    node: Node, capfd: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise ValueError("stuck")

    subscription = node.subscription("chatter", String)
    node.keep(Registration(fail))
    node.close()
    assert subscription.closed
    assert "ValueError: stuck" in capfd.readouterr().err


@pytest.mark.parametrize("size", [-1, 2.5, "7"])
def test_queues_that_mean_nothing(node: Node, size: Any) -> None:
    with pytest.raises(UsageError, match="queue_size is"):
        node.publisher("chatter", String, queue_size=size)
    with pytest.raises(UsageError, match="queue_size is"):
        node.subscription("chatter", String, queue_size=size)


def test_a_queue_longer_than_the_memory(node: Node) -> None:
    heard: SimpleQueue[str] = SimpleQueue()
    node.subscription("chatter", String, lambda m: heard.put(m.data), queue_size=10**20)
    publisher = node.publisher("chatter", String, queue_size=10**20)
    publisher.publish("hello")
    assert heard.get(timeout=TIMEOUT) == "hello"


def test_a_command_line_that_is_no_utf_8(node: Node, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["program", "file-\udcff"])
    context = node.context
    key = control_key(context.domain, context.session.zid, node.node_id)
    ask = msgspec.msgpack.encode({"action": "info"})
    (reply,) = context.session.get(key, payload=ask, timeout=TIMEOUT)
    assert reply.ok, reply.payload
    info = msgspec.msgpack.decode(reply.payload, type=NodeInfo)
    assert info.argv[1:] == ["program", "file-\ufffd"]


def test_any_text_comes_to_rosout(network: Network, node: Node) -> None:
    log = network.node("console").subscription("/rosout", Log, qos=ROSOUT)
    node.log.info("cannot read 'file-\udcff': %s", "a\0b")
    assert log.get(TIMEOUT).msg == "cannot read 'file-\\udcff': a\\x00b"


def test_timers_that_ended_are_not_kept(node: Node) -> None:
    called: SimpleQueue[object] = SimpleQueue()
    before = len(node._lifecycle._parts)
    for _ in range(50):
        node.timer(0.001, called.put, oneshot=True)
    for _ in range(50):
        called.get(timeout=TIMEOUT)
    # What else comes is the publisher of /rosout, which a thread opens.
    eventually(lambda: len(node._lifecycle._parts) <= before + 1, "only what still runs is kept")


def test_a_context_waits_for_a_node_that_is_being_closed(network: Network) -> None:
    """Ctrl-C shuts the context down on one thread, and leaves ``with`` on another."""
    node = network.node()
    session = node.context.session
    closing, go_on = threading.Event(), threading.Event()

    def close() -> None:
        closing.set()
        go_on.wait(TIMEOUT)

    node.keep(Registration(close))
    network.thread(node.close)
    assert closing.wait(TIMEOUT)
    shutdown = network.thread(node.context.shutdown)
    shutdown.join(0.3)
    assert not session.closed
    go_on.set()
    shutdown.join(TIMEOUT)
    assert session.closed


def test_nodes_declare_no_key_expression_with_wildcards_in_common(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of each session that did, Zenoh would keep kilobytes (`tests/upstream/memory.py`)."""
    declared: dict[str, set[str]] = {}
    for method in ("_subscribe", "queryable", "pull_queryable"):
        original = getattr(Session, method)

        def record(
            session: Session, key: str, *args: Any, _original: Any = original, **options: Any
        ) -> Any:
            declared.setdefault(session.zid, set()).add(key)
            return _original(session, key, *args, **options)

        monkeypatch.setattr(Session, method, record)
    for name in ("first", "second"):
        node = network.node(name)
        node.publisher("topic", String)
        node.subscription("topic", String, lambda _: None)
        node.params.set("~p", 1)
    one, other = declared.values()
    assert one & other
    assert not [key for key in one & other if "*" in key]
