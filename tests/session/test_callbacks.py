"""What a callback raises: told, and no end of what comes after."""

from __future__ import annotations

import logging
import threading
import weakref
from queue import SimpleQueue

import pytest
from network import PATIENCE, Network, eventually

from rosz.session import MeshReadiness, Sample


def test_callback_that_raises_hears_what_comes_next(
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
            assert heard.get(timeout=PATIENCE) == payload
    kept.close()
    assert "the callback of the subscriber 'topic' failed" in caplog.text
    assert "ValueError: no good" in caplog.text


def test_who_waited_for_neighbours_is_not_kept(network: Network) -> None:
    class Waiting:
        called = False

        def call(self) -> None:
            Waiting.called = True

    waiting = Waiting()
    kept = weakref.ref(waiting)
    network.session()
    session = network.session()
    mesh = MeshReadiness(session, 0.1, threading.Event())
    mesh.when_ready(waiting.call)
    del waiting
    assert mesh.ready.wait(PATIENCE)
    eventually(lambda: kept() is None, "it is let go")
    assert Waiting.called
