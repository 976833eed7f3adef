"""A subscriber that keeps fewer samples if they are large, and neither loses nor repeats one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from network import Network

from rosz.bags.record.queue import Channels
from rosz.session import PullSubscriber, Session

SMALL, LARGE = 10, 1000


def publisher_on(session: Session, key: str) -> Callable[[int, int], None]:
    """Return a function that publishes a number in a sample of a size."""
    made = session.publisher(key)
    return lambda number, size: made.put(bytes([number]) * size, bytes([number]))


def receive(subscriber: PullSubscriber, count: int) -> list[int]:
    return [subscriber.receive().payload[0] for _ in range(count)]


def test_the_newest_large_samples_stay(network: Network) -> None:
    session = network.session()
    publish = publisher_on(session, "a")
    subscriber = session.bounded_subscriber("a", 64, lambda size: 4 if size >= LARGE else 64)
    for number in range(20):
        publish(number, SMALL)
    assert receive(subscriber, 20) == list(range(20))
    publish(20, LARGE)
    assert receive(subscriber, 1) == [20]
    for number in range(21, 41):
        publish(number, LARGE)
    assert receive(subscriber, 4) == [37, 38, 39, 40]


def test_no_sample_is_lost_or_repeated(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not even those that arrive while there are two subscribers."""
    session = network.session()
    publish = publisher_on(session, "a")
    depths = {SMALL: 64, LARGE: 32, 2 * LARGE: 16}
    subscriber: Any = session.bounded_subscriber("a", 64, lambda size: depths[size])
    declare, later = subscriber._declare, iter(range(100, 106))

    def declare_and_publish(depth: int) -> Any:
        made = declare(depth)
        for _ in range(3):
            publish(next(later), LARGE)
        return made

    monkeypatch.setattr(subscriber, "_declare", declare_and_publish)
    for number in range(6):
        publish(number, LARGE if number == 2 else SMALL)
    assert receive(subscriber, 9) == [*range(6), 100, 101, 102]
    publish(6, 2 * LARGE)
    publish(7, SMALL)
    assert receive(subscriber, 5) == [6, 7, 103, 104, 105]
    publish(8, SMALL)
    assert receive(subscriber, 1) == [8]


def test_topics_share_the_bytes() -> None:
    channels = Channels(128 << 20, 8192)
    assert channels.fit("/twist", 52) == 8192
    assert channels.size == 0
    assert channels.fit("/a", 1_000_000) == 128
    assert channels.size == 128 << 20
    assert channels.fit("/b", 500_000) == 128
    assert channels.fit("/a", 1_000_000) == 64
    assert channels.size == 128 << 20
    assert channels.fit("/a", 10) == 64
    assert channels.fit("/huge", 1 << 30) == 8
    assert channels.fit("/twist", 52) == 8192
