"""Large samples for other machines: what a publisher keeps, and until when."""

from __future__ import annotations

from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.msgs.std_msgs.msg import String
from rosz.node import Node, Publisher, fetch
from rosz.node.fetch import FetchableSamples
from rosz.qos import QoS

KEEP_ALL = QoS(history="keep_all")


@pytest.fixture(autouse=True)
def each_session_a_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fetch, "host_number", lambda zid: zid)


def connected(node: Node, *readers: Node, **options: Any) -> tuple[Any, FetchableSamples]:
    """Return a publisher that knows its subscriptions, which are on other machines."""
    publisher: Publisher[String] = node.publisher("topic", String, **options)
    publisher.wait_for_subscribers(len(readers), TIMEOUT)
    samples = publisher._fetchable
    assert samples is not None
    eventually(lambda: not samples.undecided and samples.drop_unneeded())
    return publisher, samples


def large(number: int) -> String:
    return String(data=f"{number}".ljust(60_000))


def test_a_publisher_waits_for_room(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fetch, "_MOST_BYTES", 100_000)
    node, reader = network.node("talker"), network.node("listener")
    came = SimpleQueue[String]()
    reader.subscription("topic", String, came.put, qos=KEEP_ALL)
    publisher, _ = connected(node, reader, qos=KEEP_ALL)
    for number in range(20):
        publisher.publish(large(number))
    assert [int(came.get(timeout=TIMEOUT).data) for _ in range(20)] == list(range(20))
    assert not publisher.dropped


def silent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no subscription fetch anything."""
    monkeypatch.setattr(fetch.Fetcher, "announced", lambda *_: None)


def test_a_subscription_that_left_for_good_is_forgotten(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fetch, "_RETURN_SECONDS", 0.0)
    node, leaving, staying = (network.node(name) for name in ("talker", "leaving", "staying"))
    came = SimpleQueue[String]()
    staying.subscription("topic", String, came.put)
    subscription = leaving.subscription("topic", String, lambda _: None)
    publisher, samples = connected(node, leaving, staying)
    with monkeypatch.context() as patch:
        silent(patch)
        publisher.publish(large(1))
        subscription.close()
        eventually(lambda: samples.drop_unneeded() and len(samples._far) == 1)
    assert came.get(timeout=TIMEOUT).data.startswith("1")
    eventually(lambda: not samples._announcing)
    eventually(lambda: not (samples._gone or samples._kept or samples._current))


def test_a_closed_publisher_tells_of_each_subscription_that_missed_samples(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fetch, "_CLOSE_SECONDS", 0.0)
    silent(monkeypatch)
    node, reader = network.node("talker"), network.node("reader")
    for _ in range(2):
        reader.subscription("topic", String, lambda _: None)
    publisher, samples = connected(node, reader, reader)
    publisher.publish(large(1))
    assert samples.flush() == {"/reader": 2}


def test_who_is_not_known_takes_no_place(network: Network) -> None:
    node, reader = network.node("talker"), network.node("reader")
    reader.subscription("topic", String, lambda _: None)
    _, samples = connected(node, reader)
    samples._kept[1] = bytes(100), b""
    assert samples._find(fetch._Request(1, 0, "unknown"))[0] == bytes(100)
    assert not samples._current
    assert "unknown" not in samples._done
