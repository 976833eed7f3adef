"""Channels, and callbacks for what arrives rarely: no thread wakes meanwhile."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import pytest
import zenoh
from network import TIMEOUT, Network, eventually

from rosz import worker
from rosz.session import Sample, Session
from rosz.session.at_exit import OPEN
from rosz.session.channels import CallbackQueue, declare_callback

COUNT = 600  # more than Zenoh keeps for a thread of Python


RARE: dict[str, Callable[[Session, Callable[..., None]], Any]] = {
    "subscriber": lambda session, heard: session.subscriber("a/b", heard, rare=True),
    "queryable": lambda session, heard: session.queryable("a/b", heard),
    "watch": lambda session, heard: session.watch_tokens("a/b", heard),
}


def send_until(other: Session, holds: Callable[[], object]) -> None:
    """Put, query and begin tokens from another session until a condition holds."""

    def sent() -> bool:
        other.put("a/b", b"")
        other.get("a/b", timeout=0.1)
        other.token("a/b").close()
        return bool(holds())

    eventually(sent)


@pytest.mark.parametrize("kind", RARE)
def test_no_thread_while_nothing_arrives(
    network: Network, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker, "_LENT_SECONDS", 0.1)
    session, other = network.session(), network.session()
    before = set(threading.enumerate())
    heard: SimpleQueue[Any] = SimpleQueue()
    declared = RARE[kind](session, lambda *one: heard.put(one))
    send_until(other, lambda: not heard.empty())
    eventually(lambda: set(threading.enumerate()) <= before, "no thread")
    declared.close()


def test_all_threads_that_receive_hear_of_the_end(network: Network) -> None:
    session = network.session()
    queryable = session.pull_queryable("a")
    ends: SimpleQueue[Any] = SimpleQueue()
    threads = [threading.Thread(target=lambda: ends.put(queryable.receive())) for _ in range(3)]
    for thread in threads:
        thread.start()
    session.close()
    assert [ends.get(timeout=TIMEOUT) for _ in threads] == [None] * 3
    assert queryable.receive() is None


def test_callbacks_of_a_declaration_run_one_at_a_time(network: Network) -> None:
    session, other = network.session(), network.session()
    heard: list[int] = []
    inside = threading.Lock()
    complete = threading.Event()

    def callback(sample: Sample) -> None:
        assert inside.acquire(blocking=False)
        heard.append(int(sample.payload))
        threading.Event().wait(0.0005)  # others are waiting for the processor
        inside.release()
        if len(heard) == COUNT:
            complete.set()

    subscriber = session.subscriber("a/b", callback, rare=True)
    publisher = other.publisher("a/b", block=True)
    eventually(lambda: publisher.matched, "the subscriber")
    for number in range(COUNT):
        publisher.put(b"%d" % number)
    assert complete.wait(TIMEOUT)
    assert heard == list(range(COUNT))
    subscriber.close()


def test_a_callback_may_wait_for_one_of_another_declaration(network: Network) -> None:
    session, other = network.session(), network.session()
    reached, done = threading.Event(), threading.Event()
    second = session.subscriber("a/second", lambda _: reached.set(), rare=True)

    def callback(_: Sample) -> None:
        other.put("a/second", b"")
        if reached.wait(TIMEOUT):
            done.set()

    first = session.subscriber("a/first", callback, rare=True)

    def is_done() -> bool:
        other.put("a/first", b"")
        return done.wait(0.1)

    eventually(is_done)
    first.close()
    second.close()


@pytest.mark.parametrize("kind", RARE)
def test_what_arrives_while_no_thread_is_left_is_handled_later(
    network: Network, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker, "_LENT_SECONDS", 0.01)
    session, other = network.session(), network.session()
    heard: SimpleQueue[Any] = SimpleQueue()
    declared = RARE[kind](session, lambda *one: heard.put(one))
    refused: list[object] = []
    with monkeypatch.context() as patch:
        patch.setattr(worker, "lend_thread", refused.append)
        send_until(other, lambda: refused)
    send_until(other, lambda: not heard.empty())
    declared.close()


def test_a_queue_is_handled_again_after_an_error(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker, "_LENT_SECONDS", 0.01)
    queue, handled = CallbackQueue(), SimpleQueue[str]()

    def handle() -> None:
        item = queue.take()
        handled.put(item)
        if item == "bad":
            raise ValueError("no such item")

    serial = worker.Serial(handle)
    queue.handle_with(serial)
    for item in ("bad", "good"):
        queue.put(item)
        assert handled.get(timeout=TIMEOUT) == item
        eventually(
            lambda: queue._serial is not None and not queue._serial._working.locked(),
            "the end of the task",
        )
    eventually(lambda: "no such item" in caplog.text, "the log")


def test_a_failed_declaration_is_raised_and_not_waited_for(network: Network) -> None:
    session = network.session()
    before = set(OPEN)
    with pytest.raises(zenoh.ZError):
        declare_callback(lambda handler: session._raw.declare_subscriber("a//b", handler))
    assert set(OPEN) <= before


def test_what_is_closed_is_not_waited_for(network: Network) -> None:
    before = set(OPEN)
    session = network.session()
    subscriber = session.subscriber("a/b", lambda _: None, rare=True)
    assert OPEN - before
    session.close()
    subscriber.close()
    eventually(lambda: not OPEN - before, "the end of the threads of Zenoh")
