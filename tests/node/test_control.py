"""What a node answers about itself, however much it is asked."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import msgspec
import pytest
from network import TIMEOUT, Network

from rosz.node import Node, control
from rosz.node.control import NodeInfo, Request, control_key
from rosz.session import Reply, Session

_INFO = msgspec.msgpack.encode(Request("info"))


def asker(network: Network, node: Node) -> Callable[..., list[Reply]]:
    """Return a function that asks a node something from elsewhere."""
    key = control_key(node.context.domain, node.context.session.zid, node.node_id)
    session: Session = network.context().session

    def ask(action: str, **more: str) -> list[Reply]:
        payload = msgspec.msgpack.encode(Request(action, **more))
        return session.get(key, payload=payload, timeout=TIMEOUT)

    return ask


def threads(name: str) -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name.startswith(name)]


def test_many_questions_take_few_threads(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    node = network.node("busy")
    key = control_key(node.context.domain, node.context.session.zid, node.node_id)
    session = network.context().session
    go_on = threading.Event()
    at_work: SimpleQueue[None] = SimpleQueue()
    info = control._info

    def slowly(*args: Any) -> NodeInfo:
        at_work.put(None)
        assert go_on.wait(TIMEOUT)
        return info(*args)

    monkeypatch.setattr(control, "_info", slowly)
    asked = [session.query(key, timeout=TIMEOUT, payload=_INFO) for _ in range(200)]
    for _ in range(control._THREADS):
        at_work.get(timeout=TIMEOUT)
    assert len(threads("rosz-control/busy")) == control._THREADS
    go_on.set()
    found = [reply.ok for answers in asked for reply in answers]
    assert found == [True] * len(asked)
    assert len(threads("rosz-control/busy")) == control._THREADS


def test_a_node_answers_while_it_ends(network: Network) -> None:
    """Its hooks take as long as they like, and it is asked to end more than once."""
    node = network.node("slow")
    ask = asker(network, node)
    begun, go_on = threading.Event(), threading.Event()

    def hook(_reason: str) -> None:
        begun.set()
        assert go_on.wait(TIMEOUT)

    node.on_shutdown(hook)
    assert ask("shutdown")[0].ok
    assert begun.wait(TIMEOUT)
    for _ in range(3 * control._THREADS):
        assert ask("shutdown")[0].ok
    (reply,) = ask("info")
    assert msgspec.msgpack.decode(reply.payload, type=NodeInfo).name == "/slow"
    assert len(threads("rosz-shutdown/slow")) == 1
    go_on.set()


def test_what_means_nothing_is_refused_and_the_next_is_answered(network: Network) -> None:
    ask = asker(network, network.node("sound"))
    for _ in range(2 * control._THREADS):
        (refused,) = ask("dance")
        assert not refused.ok
        assert b"a node has no action 'dance'" in refused.payload
    assert ask("info")[0].ok
