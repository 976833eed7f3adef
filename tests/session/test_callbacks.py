"""Callbacks that raise are logged, and called again; finished ones are freed."""

from __future__ import annotations

import logging
import threading
import weakref
from queue import SimpleQueue

import pytest
from network import TIMEOUT, Network, eventually

from rosz.session import MeshReadiness, Sample


def test_a_callback_that_raises_gets_the_next_sample(
    network: Network, caplog: pytest.LogCaptureFixture
) -> None:
    heard: SimpleQueue[bytes] = SimpleQueue()

    def fail(sample: Sample) -> None:
        heard.put(sample.payload)
        if sample.payload == b"bad":
            raise ValueError("no good")

    session = network.session()
    kept = session.subscriber("topic", fail)
    with caplog.at_level(logging.ERROR, "rosz.session"):
        for payload in (b"bad", b"good"):
            session.put("topic", payload)
            assert heard.get(timeout=TIMEOUT) == payload
    kept.close()
    assert "the callback of the subscriber 'topic' failed" in caplog.text
    assert "ValueError: no good" in caplog.text


def test_a_callback_of_mesh_readiness_is_freed(network: Network) -> None:
    class Waiting:
        called = False

        def call(self) -> None:
            Waiting.called = True

    waiting = Waiting()
    kept = weakref.ref(waiting)
    network.session()
    session = network.session()
    mesh = MeshReadiness(session, 0.1, threading.Event())
    mesh.when_linked(waiting.call)
    del waiting
    assert mesh.linked.wait(TIMEOUT)
    eventually(lambda: kept() is None, "the callback is freed")
    assert Waiting.called
