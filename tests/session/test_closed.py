"""What is closed refuses everything with one kind of error, which says what was refused."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import pytest
from network import TIMEOUT, Network

from rosz.errors import ClosedError, TransportError
from rosz.session import Cancellation, Query, Session

CALLS: dict[str, Callable[[Session], object]] = {
    "put": lambda session: session.put("a", b""),
    "delete": lambda session: session.delete("a"),
    "publisher": lambda session: session.publisher("a"),
    "publisher with a cache": lambda session: session.publisher("a", cache=1),
    "subscriber": lambda session: session.subscriber("a", print),
    "subscriber with history": lambda session: session.subscriber("a", print, history=1),
    "pull_subscriber": lambda session: session.pull_subscriber("a", 1),
    "queue_subscriber": lambda session: session.queue_subscriber("a", 1, print),
    "queue_subscriber with history": lambda session: session.queue_subscriber(
        "a", 1, print, history=1, recover=True
    ),
    "queryable": lambda session: session.queryable("a", print),
    "get": lambda session: session.get("a", timeout=1),
    "get_async": lambda session: session.get_async("a", print, print, timeout=1),
    "token": lambda session: session.token("a"),
    "tokens": lambda session: session.watch_tokens("a", print),
    "live_tokens": lambda session: session.live_tokens("a", 1),
    "peers": lambda session: session.peers(),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_nothing_works_after_close(network: Network, call: Callable[[Session], object]) -> None:
    session = network.session()
    assert not session.closed
    session.close()
    session.close()
    assert session.closed
    with pytest.raises(ClosedError, match="the session is closed"):
        call(session)


@pytest.mark.parametrize(
    "name", [name for name in CALLS if "publisher" in name or "subscr" in name]
)
def test_closed_by_another_thread_just_after_the_check(
    network: Network, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    session = network.session()
    check = session._lifecycle.check_open

    def check_and_close(doing: str) -> None:
        check(doing)
        session.close()

    monkeypatch.setattr(session._lifecycle, "check_open", check_and_close)
    with pytest.raises(ClosedError):
        CALLS[name](session)


DECLARED: dict[str, tuple[Callable[[Session], Any], Callable[[Any], object]]] = {
    "put": (lambda session: session.publisher("a"), lambda one: one.put(bytes(100_000))),
    "put with a cache": (
        lambda session: session.publisher("a", cache=1),
        lambda one: one.put(bytes(100_000)),
    ),
    "matched": (lambda session: session.publisher("a"), lambda one: one.matched),
    "query": (
        lambda session: session.querier("a", timeout=1),
        lambda one: one.query(b"", b"", Cancellation()),
    ),
}


@pytest.mark.parametrize(("declare", "call"), DECLARED.values(), ids=DECLARED)
def test_closed_while_other_threads_use_it(
    network: Network, declare: Callable[[Session], Any], call: Callable[[Any], object]
) -> None:
    """Zenoh refuses to undeclare what a thread is using; the last one to leave does it."""
    session = network.session()
    ends: list[BaseException] = []

    def use(declared: Any, inside: threading.Barrier) -> None:
        try:
            call(declared)
            inside.wait(TIMEOUT)
            while True:
                call(declared)
        except BaseException as error:  # noqa: BLE001  # compared below
            ends.append(error)

    for _ in range(10):
        declared, inside = declare(session), threading.Barrier(4)
        users = [threading.Thread(target=use, args=(declared, inside)) for _ in range(3)]
        for user in users:
            user.start()
        inside.wait(TIMEOUT)
        declared.close()
        for user in users:
            user.join(TIMEOUT)
        assert not declared._entities, "it was not undeclared"
    assert {type(error) for error in ends} == {ClosedError}
    assert len(ends) == 30


def test_a_query_that_another_thread_replies_to_is_closed(network: Network) -> None:
    session = network.session()
    errors: list[BaseException] = []

    def answer(query: Query) -> None:
        def report() -> None:
            with suppress(TransportError):  # it is closed
                while True:
                    query.reply("a", b"more")

        try:
            reporter = network.thread(report)
            query.reply("a", b"last")
            query.close()
            reporter.join(TIMEOUT)
        except BaseException as error:
            errors.append(error)
            raise

    queryable = session.queryable("a", answer)
    for _ in range(20):
        replies = [reply.payload for reply in session.get("a", timeout=TIMEOUT)]
        assert b"last" in replies
        assert b"Timeout" not in replies
    queryable.close()
    assert errors == []
