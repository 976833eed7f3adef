"""What a signal handler may call in the midst of the same call: here it is called from within."""

from __future__ import annotations

import threading
from typing import Any

import pytest
from network import TIMEOUT, Network

from rosz.msgs.std_msgs.msg import String
from rosz.session import MeshReadiness


def in_time(call: Any) -> None:
    """Call on a thread of its own, so that one which waits for itself does not end the test run."""
    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(TIMEOUT)
    assert not thread.is_alive(), "it waits for the one that it interrupted"


def test_subscribing(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    context = network.context()
    direct, session = context.direct_delivery, context.session
    subscriber = session.subscriber
    opened: list[int] = []

    def interrupted(*args: Any, **options: Any) -> Any:
        if not opened:
            opened.append(1)
            direct.register(1, lambda _: None, lambda _: None)
        return subscriber(*args, **options)

    monkeypatch.setattr(session, "subscriber", interrupted)
    in_time(lambda: direct.register(2, lambda _: None, lambda _: None))
    assert {key.removesuffix("/large")[-1] for key in direct._receivers} == {"1", "2"}


def test_learning_a_type(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    subscription = network.node().subscription("chatter")
    learn = subscription._decoders._find
    learned: list[str] = []

    def interrupted(type_name: str, type_hash: str) -> Any:
        learned.append(type_name)
        if len(learned) == 1:
            subscription._decoders.of_type(String._type, String._type_hash)
        return learn(type_name, type_hash)

    monkeypatch.setattr(subscription._decoders, "_find", interrupted)
    in_time(lambda: subscription._decoders.of_type(String._type_name, String._type_hash))
    assert len(learned) == 2


def test_waiting_for_neighbours(network: Network) -> None:
    mesh = MeshReadiness(network.session(), 0, threading.Event())
    asked: list[int] = []

    class Interrupted(threading.Event):
        def is_set(self) -> bool:
            if not asked:
                asked.append(1)
                mesh.when_linked(lambda: asked.append(2))
            return super().is_set()

    mesh.linked = Interrupted()
    in_time(lambda: mesh.when_linked(lambda: asked.append(3)))
    assert asked == [1]
    assert len(mesh._callbacks) == 2
