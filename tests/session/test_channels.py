"""Channels, and callbacks for what arrives rarely: no thread wakes meanwhile."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest
import zenoh
from network import TIMEOUT, Network, eventually

from rosz.session import Sample, Session, channels
from rosz.session.at_exit import OPEN
from rosz.session.channels import CallbackQueue, declare_callback, declare_rare

COUNT = 600  # more than Zenoh keeps for a thread of Python


def _wakes(thread: threading.Thread) -> int:
    """Return how often a thread has given up the processor by itself."""
    status = Path(f"/proc/self/task/{thread.native_id}/status").read_text()
    return int(status.partition("voluntary_ctxt_switches:")[2].split()[0])


RARE: dict[str, Callable[[Session, Callable[..., None]], Any]] = {
    "subscriber": lambda session, heard: session.subscriber("a/b", heard, rare=True),
    "queryable": lambda session, heard: session.queryable("a/b", heard),
    "watch": lambda session, heard: session.watch_tokens("a/b", heard),
}


def until_heard(other: Session, heard: SimpleQueue[Any]) -> None:
    """Put and query from another session until something is heard."""

    def is_heard() -> bool:
        other.put("a/b", b"")
        other.get("a/b", timeout=0.1)
        return not heard.empty()

    eventually(is_heard)


@pytest.mark.parametrize("kind", RARE)
def test_no_thread_wakes_while_nothing_arrives(network: Network, kind: str) -> None:
    session, other = network.session(), network.session()
    before = set(threading.enumerate())
    heard: SimpleQueue[Any] = SimpleQueue()
    declared = RARE[kind](session, lambda *one: heard.put(one))
    new = set(threading.enumerate()) - before
    own = {one for one in new if "pyo3" in one.name}
    assert own
    assert all(one.daemon for one in own)
    assert {one.name for one in new - own} <= {"rosz-lent"}
    token = other.token("a/b")

    until_heard(other, heard)
    while not heard.empty():
        heard.get()
    counts = {one: _wakes(one) for one in own}
    assert not threading.Event().wait(2.0)  # in which a thread that polls wakes twenty times
    assert all(_wakes(one) - count < 10 for one, count in counts.items())
    declared.close()
    eventually(lambda: not any(one.is_alive() for one in own), "the end of its threads")
    token.close()


def test_a_failed_declaration_is_raised_and_leaves_no_thread(network: Network) -> None:
    session = network.session()
    before = set(threading.enumerate())

    def fail(handler: Any) -> None:
        session._raw.declare_subscriber("a//b", handler)

    with pytest.raises(zenoh.ZError):
        declare_rare(fail)
    eventually(lambda: not {one for one in threading.enumerate() if "pyo3" in one.name} - before)


def test_all_threads_that_receive_hear_of_the_end(network: Network) -> None:
    session = network.session()
    queryable = session.pull_queryable("a", rare=True)
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


@pytest.mark.usefixtures("no_threads")
@pytest.mark.parametrize("kind", RARE)
def test_callbacks_where_no_thread_is_left(network: Network, kind: str) -> None:
    """They run on the thread that Zenoh has started."""
    session, other = network.session(), network.session()
    heard: SimpleQueue[str] = SimpleQueue()
    declared = RARE[kind](session, lambda *_: heard.put(threading.current_thread().name))
    token = other.token("a/b")

    until_heard(other, heard)
    assert "pyo3" in heard.get()
    declared.close()
    token.close()


@pytest.fixture
def no_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lend no thread."""
    monkeypatch.setattr(channels, "lend_thread", lambda _: False)


def test_a_queue_is_handled_again_after_an_error(caplog: pytest.LogCaptureFixture) -> None:
    queue, handled = CallbackQueue(), SimpleQueue[str]()

    def handle() -> None:
        item = queue.take()
        handled.put(item)
        if item == "bad":
            raise ValueError("no such item")

    queue.handle_with(handle, at_once=False)
    for item in ("bad", "good"):
        queue.handler.callback(item)
        assert handled.get(timeout=TIMEOUT) == item
        eventually(lambda: bool(queue._unhandled), "the end of the task")
    eventually(lambda: "no such item" in caplog.text, "the log")


def test_a_failed_callback_declaration_is_not_waited_for(network: Network) -> None:
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
