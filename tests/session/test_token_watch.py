"""What a watch reports of tokens that come and go."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import zenoh

from rosz.session.token_watch import TokenWatch

_PUT, _DELETE = zenoh.SampleKind.PUT, zenoh.SampleKind.DELETE


def _reported(*kinds: Any, live: list[str]) -> list[bool]:
    """Return what a watch reports of a token that a query names, or does not name."""
    reported: list[bool] = []
    watch = TokenWatch(lambda _key, alive: reported.append(alive), {}, lambda: live)
    for kind in kinds:
        sample: Any = SimpleNamespace(key_expr="token", kind=kind)
        watch.deliver(sample)
    return reported


def test_a_token_that_comes_again_is_there_whatever_a_query_says() -> None:
    """Queries of Zenoh may miss tokens while others come and go."""
    assert _reported(_PUT, _DELETE, _PUT, live=[]) == [True, False, True]


def test_a_token_whose_end_came_first_is_there_if_a_query_names_it() -> None:
    assert _reported(_DELETE, _PUT, live=[]) == [False]
    assert _reported(_DELETE, _PUT, live=["token"]) == [False, True]
