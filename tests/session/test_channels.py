"""Channels: a thread that waits for what arrives rarely does not wake meanwhile."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest
import zenoh
from network import TIMEOUT, Network, eventually

from rosz.session import Session
from rosz.session.channels import declare_rare


def _wakes(thread: threading.Thread) -> int:
    """Return how often a thread has given up the processor by itself."""
    status = Path(f"/proc/self/task/{thread.native_id}/status").read_text()
    return int(status.partition("voluntary_ctxt_switches:")[2].split()[0])


RARE: dict[str, Callable[[Session, Callable[..., None]], Any]] = {
    "subscriber": lambda session, heard: session.subscriber("a/b", heard, rare=True),
    "queryable": lambda session, heard: session.queryable("a/b", heard),
    "watch": lambda session, heard: session.watch_tokens("a/b", heard),
}


@pytest.mark.parametrize("kind", RARE)
def test_a_thread_that_waits_does_not_wake(network: Network, kind: str) -> None:
    session, other = network.session(), network.session()
    before = set(threading.enumerate())
    heard: SimpleQueue[Any] = SimpleQueue()
    declared = RARE[kind](session, lambda *one: heard.put(one))
    own = {one for one in set(threading.enumerate()) - before if one.name != "rosz-declare"}
    own = {one for one in own if kind in one.name or "pyo3" in one.name}
    assert own
    assert all(one.daemon for one in own)
    token = other.token("a/b")

    def is_heard() -> bool:
        other.put("a/b", b"")
        other.get("a/b", timeout=0.1)
        return not heard.empty()

    eventually(is_heard)
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
