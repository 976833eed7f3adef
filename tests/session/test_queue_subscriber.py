"""A subscriber that keeps the newest samples, and neither loses nor repeats one."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually
from zenoh.handlers import RingChannel

from rosz import worker
from rosz.bags.record.queue import Channels
from rosz.errors import TransportError
from rosz.session import Sample, Session, declared

SMALL, LARGE = 10, 1000


def publisher_on(session: Session, key: str) -> Callable[[int, int], None]:
    """Return a function that publishes a number in a sample of a size."""
    made = session.publisher(key)
    return lambda number, size: made.put(bytes([number]) * size, bytes([number]))


class Handled:
    """The samples that a subscriber has handled, and a gate that holds it up when it is closed."""

    def __init__(self) -> None:
        self.numbers: SimpleQueue[int] = SimpleQueue()
        self.gate = threading.Event()
        self.gate.set()

    def __call__(self, sample: Sample) -> None:
        self.numbers.put(sample.payload[0])
        assert self.gate.wait(TIMEOUT)

    def get(self, count: int) -> list[int]:
        return [self.numbers.get(timeout=TIMEOUT) for _ in range(count)]


@pytest.fixture
def handled() -> Iterator[Handled]:
    made = Handled()
    yield made
    made.gate.set()


@pytest.fixture(autouse=True)
def sweeps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the second sample of a subscriber make it busy; it rests when the test says so."""
    monkeypatch.setattr(declared, "_MANY", 1)
    monkeypatch.setattr(declared, "_OFTEN_SECONDS", TIMEOUT)
    monkeypatch.setattr(declared, "_sweeper", worker.Serial(lambda: None))


def make_busy(subscriber: Any, publish: Callable[[int, int], None], handled: Handled) -> None:
    for number in (254, 255):
        publish(number, SMALL)
    assert handled.get(2) == [254, 255]
    eventually(lambda: subscriber._idle, "a thread that waits for samples")


@pytest.mark.parametrize("busy", [False, True])
def test_the_newest_samples_stay(
    network: Network, handled: Handled, monkeypatch: pytest.MonkeyPatch, *, busy: bool
) -> None:
    session = network.session()
    publish = publisher_on(session, "a")
    subscriber = session.queue_subscriber(
        "a", 64, handled, fit=lambda size: 4 if size >= LARGE else 64
    )
    if busy:
        make_busy(subscriber, publish, handled)
    else:
        monkeypatch.setattr(declared, "_OFTEN_SECONDS", -1.0)
    handled.gate.clear()
    for number in range(20):
        publish(number, SMALL)
    assert handled.get(1) == [0]
    handled.gate.set()
    assert handled.get(19) == list(range(1, 20))
    handled.gate.clear()
    publish(20, LARGE)
    assert handled.get(1) == [20]
    for number in range(21, 41):
        publish(number, LARGE)
    handled.gate.set()
    assert handled.get(4) == [37, 38, 39, 40]
    subscriber.close()
    eventually(lambda: subscriber not in declared._busy, "its end")


def test_no_sample_is_lost_or_repeated(
    network: Network, handled: Handled, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not even those that arrive while there are two subscribers."""
    session = network.session()
    publish = publisher_on(session, "a")
    depths = {SMALL: 64, LARGE: 32, 2 * LARGE: 16}
    subscriber: Any = session.queue_subscriber("a", 64, handled, fit=lambda size: depths[size])
    declare, later = subscriber._declare, iter(range(100, 109))

    def declare_and_publish(handler: Any) -> Any:
        made = declare(handler)
        for _ in range(3):
            publish(next(later), SMALL)
        return made

    monkeypatch.setattr(subscriber, "_declare", declare_and_publish)
    publish(0, SMALL)
    assert handled.get(1) == [0]
    publish(1, SMALL)
    assert handled.get(4) == [1, 100, 101, 102]
    publish(2, LARGE)
    assert handled.get(4) == [2, 103, 104, 105]
    publish(3, 2 * LARGE)
    assert handled.get(4) == [3, 106, 107, 108]
    publish(4, SMALL)
    assert handled.get(1) == [4]


def test_none_comes_after_a_newer_one(
    network: Network, handled: Handled, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The channel may get a sample when a newer one has replaced it in the queue already."""
    session = network.session()
    publish = publisher_on(session, "a")
    subscriber: Any = session.queue_subscriber("a", 1, handled)
    declare = subscriber._declare

    def declare_and_publish(_: Any) -> Any:
        made = declare(RingChannel(2))
        publish(2, SMALL)
        publish(3, SMALL)
        return made

    monkeypatch.setattr(subscriber, "_declare", declare_and_publish)
    for numbers in ([0], [1, 3], [4]):
        publish(numbers[0], SMALL)
        assert handled.get(len(numbers)) == numbers


def test_closed_in_its_own_callback(network: Network) -> None:
    session = network.session()
    publish = publisher_on(session, "a")
    closed = threading.Event()

    def handle(sample: Sample) -> None:
        if sample.payload[0] == 3:
            subscriber.close()
            closed.set()

    subscriber = session.queue_subscriber("a", 64, handle)
    for number in range(4):
        publish(number, SMALL)
    assert closed.wait(TIMEOUT)
    eventually(lambda: subscriber not in declared._busy, "its end")


@pytest.mark.parametrize("busy", [False, True])
def test_a_closed_one_has_no_thread(
    network: Network,
    handled: Handled,
    monkeypatch: pytest.MonkeyPatch,
    *,
    busy: bool,
) -> None:
    monkeypatch.setattr(worker, "_LENT_SECONDS", 0.1)
    session = network.session()
    publish = publisher_on(session, "a")
    before = set(threading.enumerate())
    subscriber = session.queue_subscriber("a", 64, handled)
    if busy:
        make_busy(subscriber, publish, handled)
    publish(0, SMALL)
    assert handled.get(1) == [0]
    subscriber.close()
    eventually(lambda: set(threading.enumerate()) <= before, "the end of its threads")


def test_one_that_cannot_become_busy_goes_on(
    network: Network,
    handled: Handled,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    session = network.session()
    publish = publisher_on(session, "a")
    subscriber: Any = session.queue_subscriber("a", 64, handled)

    def fail(_: object) -> None:
        raise TransportError("no more subscribers")

    monkeypatch.setattr(subscriber, "_declare", fail)
    for number in range(5):
        publish(number, SMALL)
    assert handled.get(5) == list(range(5))
    assert "no more subscribers" in caplog.text


def test_a_busy_one_rests_and_becomes_busy_again(
    network: Network, handled: Handled, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No sample is lost or repeated meanwhile, whenever it comes."""
    monkeypatch.setattr(worker, "_LENT_SECONDS", 0.1)
    session = network.session()
    publish = publisher_on(session, "a")
    before = set(threading.enumerate())
    subscriber: Any = session.queue_subscriber("a", 64, handled)
    make_busy(subscriber, publish, handled)
    for _ in range(2):
        subscriber.leave_channel_if_idle()
    assert subscriber._next_queue is not None
    for number in range(3):
        publish(number, SMALL)
    assert handled.get(3) == [0, 1, 2]
    eventually(lambda: subscriber._idle)
    subscriber.leave_channel_if_idle()
    assert subscriber._next_queue is None
    assert subscriber._channel is not None

    subscriber.leave_channel_if_idle()
    close = subscriber._channel.close

    def publish_and_close() -> None:
        publish(3, SMALL)
        publish(4, SMALL)
        close()

    monkeypatch.setattr(subscriber._channel, "close", publish_and_close)
    with monkeypatch.context() as patch:
        patch.setattr(declared, "_OFTEN_SECONDS", -1.0)  # the queue may have the last samples
        subscriber.leave_channel_if_idle()
        assert handled.get(2) == [3, 4]
        eventually(lambda: set(threading.enumerate()) <= before, "no thread")
    make_busy(subscriber, publish, handled)
    publish(5, SMALL)
    assert handled.get(1) == [5]


def test_samples_without_attachments_are_not_lost(
    network: Network, handled: Handled, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing tells them apart, so one that two subscribers have is handled twice."""
    session = network.session()
    made = session.publisher("a")
    subscriber: Any = session.queue_subscriber("a", 64, handled)
    seen: set[int] = set()

    def publish(*numbers: int) -> None:
        for number in numbers:
            made.put(bytes([number]))

    def handle(*numbers: int) -> None:
        while not seen.issuperset(numbers):
            seen.update(handled.get(1))

    for turn in (0, 100):  # busy, at rest, and busy again
        publish(turn, turn + 1)
        handle(turn, turn + 1)
        eventually(lambda: subscriber._idle, "a thread that waits for samples")
        for _ in range(2):
            subscriber.leave_channel_if_idle()
        close = subscriber._channel.close

        def publish_and_close(turn: int = turn, close: Callable[[], None] = close) -> None:
            publish(turn + 2, turn + 3)
            close()

        monkeypatch.setattr(subscriber._channel, "close", publish_and_close)
        with monkeypatch.context() as patch:
            patch.setattr(declared, "_OFTEN_SECONDS", -1.0)
            subscriber.leave_channel_if_idle()
            handle(turn + 2, turn + 3)
            eventually(lambda: subscriber._channel is None, "its rest")


def test_one_whose_callback_takes_long_does_not_rest(network: Network, handled: Handled) -> None:
    session = network.session()
    publish = publisher_on(session, "a")
    subscriber: Any = session.queue_subscriber("a", 64, handled)
    make_busy(subscriber, publish, handled)
    handled.gate.clear()
    for number in range(5):
        publish(number, SMALL)
    assert handled.get(1) == [0]
    for _ in range(5):
        subscriber.leave_channel_if_idle()
    assert subscriber._next_queue is None
    handled.gate.set()
    assert handled.get(4) == [1, 2, 3, 4]


def test_a_closed_one_rests_no_more(network: Network, handled: Handled) -> None:
    session = network.session()
    subscriber: Any = session.queue_subscriber("a", 64, handled)
    make_busy(subscriber, publisher_on(session, "a"), handled)
    for _ in range(2):
        subscriber.leave_channel_if_idle()
    subscriber.close()
    eventually(lambda: subscriber not in declared._busy, "its end")
    subscriber.leave_channel_if_idle()


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
