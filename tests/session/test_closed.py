"""A closed session refuses everything with one kind of error, which says what was refused."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from network import Network

from rosz.errors import ClosedError
from rosz.session import Session

CALLS: dict[str, Callable[[Session], object]] = {
    "put": lambda session: session.put("a", b""),
    "delete": lambda session: session.delete("a"),
    "publisher": lambda session: session.publisher("a"),
    "publisher with a cache": lambda session: session.publisher("a", cache=1),
    "subscriber": lambda session: session.subscriber("a", print),
    "subscriber with history": lambda session: session.subscriber("a", print, history=1),
    "pull_subscriber": lambda session: session.pull_subscriber("a", 1),
    "pull_subscriber with history": lambda session: session.pull_subscriber(
        "a", 1, history=1, recover=True
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
