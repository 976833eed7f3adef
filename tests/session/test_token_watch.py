"""What a watch reports of tokens that come and go."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
import zenoh
from network import TIMEOUT, Network, eventually

from rosz.session import Session, SessionConfig
from rosz.session.token_watch import TokenWatch

_PUT, _DELETE = zenoh.SampleKind.PUT, zenoh.SampleKind.DELETE


def _reported(*kinds: Any, live: list[list[str]], begins: bool = False) -> list[bool]:
    """Return what a watch reports of a token.

    Args:
        kinds: What the watch is told.
        live: What its queries find, one after the other.
        begins: Whether all this comes before the watch is complete; its first query finds nothing.
    """
    reported: list[bool] = []
    queries = iter(live)
    watch = TokenWatch(lambda _key, alive: reported.append(alive), {}, lambda: next(queries))
    watch.complete = (lambda: None) if begins else None
    for kind in kinds:
        sample: Any = SimpleNamespace(key_expr="token", kind=kind)
        watch.deliver(sample)
    watch.idle()
    return reported


def test_a_token_that_comes_again_is_there_whatever_a_query_says() -> None:
    """Queries of Zenoh may miss tokens while others come and go."""
    assert _reported(_PUT, _DELETE, _PUT, live=[]) == [True, False, True]


def test_a_token_whose_end_came_first_is_there_if_a_query_names_it() -> None:
    assert _reported(_DELETE, _PUT, live=[[]] * 6) == [False]
    assert _reported(_DELETE, _PUT, live=[[], ["token"]]) == [False, True]


def test_a_token_that_the_first_query_misses_is_there_if_another_names_it() -> None:
    assert _reported(_PUT, live=[[]] * 6, begins=True) == [True, False]
    assert _reported(_PUT, live=[*[[]] * 5, ["token"]], begins=True) == [True]


def test_a_token_has_ended_that_zenoh_keeps(network: Network) -> None:
    """See `tests/upstream/late_reply.py`; here a router that is stopped delays the reply."""
    router = network.run("-m", "rosz", "core")
    router.wait_for("started core")
    config = SessionConfig(mode="client", rendezvous=network.rendezvous)
    session = network.session(config)
    token = network.session(config).token("k/1")
    eventually(lambda: session.live_tokens("k/*", TIMEOUT), "the token")
    router.send(signal.SIGSTOP)
    os.waitpid(router.pid, os.WUNTRACED)
    assert session.live_tokens("k/*", 0.01) == []
    router.send(signal.SIGCONT)
    assert session.live_tokens("k/*", TIMEOUT) == ["k/1"]
    token.close()
    eventually(lambda: not session.live_tokens("k/*", TIMEOUT), "the end of the token")
    events: list[bool] = []
    complete = threading.Event()
    watch = session.watch_tokens("k/*", lambda _, alive: events.append(alive), complete.set)
    assert complete.wait(TIMEOUT)
    watch.close()
    assert events == [True, False]  # else Zenoh forgets it, and a watch need not ask again


def test_looks_are_united(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each query misses a token, as queries on a busy machine sometimes do."""
    session, other = network.session(), network.session()
    tokens = [other.token(f"k/{number}") for number in range(3)]
    eventually(lambda: len(session.live_tokens("k/*", TIMEOUT)) == len(tokens), "the tokens")
    query, missed = Session.query_tokens, iter(["k/0", "k/1", "k/2", "k/0"])

    def forgetful(self: Session, key: str, timeout: float) -> Callable[[], list[str]]:
        reply, left_out = query(self, key, timeout), next(missed)
        return lambda: [live for live in reply() if live != left_out]

    monkeypatch.setattr(Session, "query_tokens", forgetful)
    assert session.live_tokens("k/*", TIMEOUT) == ["k/1", "k/2"]
    assert session.live_tokens("k/*", TIMEOUT, 3) == ["k/0", "k/1", "k/2"]
    for token in tokens:
        token.close()
