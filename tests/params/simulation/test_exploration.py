"""Small worlds in every order; ``python -m tests.params.simulation --explore`` tries more."""

from __future__ import annotations

import os

import pytest

from .exploration import SCRIPTS, explore
from .mutations import faulty, takes_an_acknowledgement_for_the_newest_batch

MOST = int(os.environ.get("ROSZ_EXAMPLES", "100")) * 3


@pytest.mark.parametrize("name", sorted(SCRIPTS))
def test_what_must_hold_holds_in_every_order(name: str) -> None:
    result = explore(SCRIPTS[name], MOST)
    print(f"{name}: {result}")
    assert not result.finding


def test_all_of_a_small_world_is_explored() -> None:
    result = explore(SCRIPTS["two"], 2000)
    assert result.finished
    assert result.ends


def test_a_fault_is_found() -> None:
    with faulty(takes_an_acknowledgement_for_the_newest_batch):
        assert explore(SCRIPTS["two, four"], 2000).finding
