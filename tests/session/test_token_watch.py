"""What a watch reports of tokens that come and go."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import pytest
import zenoh
from network import TIMEOUT, Network, eventually, repeats

from rosz.session.token_watch import TokenWatch

_PUT, _DELETE = zenoh.SampleKind.PUT, zenoh.SampleKind.DELETE


class _Reports:
    """What a watch reports of one token that a query names, or does not name."""

    def __init__(self, live: list[str], *, complete: bool = True) -> None:
        self.reports: list[bool] = []
        self.live = live
        self.stale: set[str] = set()
        self.watch = TokenWatch(
            lambda _key, alive: self.reports.append(alive), {}, self.stale, lambda: self.live
        )
        if not complete:
            self.watch.complete = lambda: None

    def of(self, *kinds: Any) -> list[bool]:
        """Return all reports after some more samples."""
        for kind in kinds:
            sample: Any = SimpleNamespace(key_expr="token", kind=kind)
            self.watch.deliver(sample)
        self.watch.idle()
        return self.reports


def test_a_token_that_comes_again_later_is_there_whatever_a_query_says(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Queries of Zenoh may miss tokens while others come and go."""
    monkeypatch.setattr("rosz.session.token_watch._RECENT_SECONDS", 0.0)
    assert _Reports(live=[]).of(_PUT, _DELETE, _PUT) == [True, False, True]


def test_a_token_that_comes_right_after_its_end_is_there_if_a_query_names_it() -> None:
    for first, before in ((_DELETE, [False]), (_PUT, [True, False])):
        kinds = (first, _PUT) if first is _DELETE else (first, _DELETE, _PUT)
        assert _Reports(live=[]).of(*kinds) == before
        assert _Reports(live=["token"]).of(*kinds) == [*before, True]


def test_a_token_that_a_session_remembers_wrongly_is_not_there() -> None:
    """Each watch of the session is told of it, at its beginning or a little later."""
    early = _Reports(live=[], complete=False)
    assert early.of(_PUT) == [True, False]
    assert early.stale == {"token"}
    late = _Reports(live=[])
    late.stale.add("token")
    assert late.of(_PUT) == []
    late.live = ["token"]  # it has come again
    assert late.of(_PUT) == [True]
    assert late.stale == set()


def test_watches_that_begin_while_tokens_end(network: Network) -> None:
    """Zenoh tells them that a token exists which has ended, and later watches as well."""
    session, other = network.session(), network.session()
    tokens: dict[str, bool] = {}
    lasting = session.watch_tokens("x/*", tokens.__setitem__)
    for number in range(repeats(200, 2000)):
        token = other.token(f"x/{number}")
        eventually(lambda: f"x/{number}" in session.live_tokens("x/*", TIMEOUT))  # noqa: B023
        reported: dict[str, bool] = {}
        complete = threading.Event()
        ended = network.thread(token.close)
        watch = session.watch_tokens("x/*", reported.__setitem__, complete.set)
        ended.join(TIMEOUT)
        assert complete.wait(TIMEOUT)
        eventually(lambda: not any(reported.values()), f"the end of {reported}")  # noqa: B023
        watch.close()
    eventually(lambda: not any(tokens.values()), "the end of all at the watch that lasts")
    lasting.close()
