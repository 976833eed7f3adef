"""Small worlds in every order; ``python -m tests.params.simulation --explore`` tries more."""

from __future__ import annotations

import os

import pytest

from . import mutations
from .exploration import explore
from .mutations import Mutation, faulty
from .scripts import SCRIPTS

MOST = int(os.environ.get("ROSZ_EXAMPLES", "100")) * 3


@pytest.mark.parametrize("name", sorted(SCRIPTS))
def test_what_must_hold_holds_in_every_order(name: str) -> None:
    result = explore(SCRIPTS[name], MOST)
    print(f"{name}: {result}")
    assert not result.finding


@pytest.mark.parametrize("name", ["two", "two, loss"])
def test_all_of_a_small_world_is_explored(name: str) -> None:
    result = explore(SCRIPTS[name], 5000)
    print(f"{name}: {result}")
    assert result.finished, result.finding
    assert result.ends


@pytest.mark.parametrize(
    ("mutation", "name"),
    [
        (mutations.acknowledges_before_the_disk, "two, stored"),
        (mutations.answers_before_the_own_disk, "two, stored"),
        (mutations.takes_an_acknowledgement_for_the_newest_batch, "two, four"),
        (mutations.never_sends_again, "two, cut"),
        (mutations.waits_without_a_limit, "two, cut"),
        (mutations.does_not_miss_whom_it_lost, "two, cut"),
        (mutations.never_forgets_a_member, "two, end"),
        (mutations.leaves_without_handing_over, "two, end"),
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_a_fault_is_found(mutation: Mutation, name: str) -> None:
    with faulty(mutation):
        result = explore(SCRIPTS[name], 2000)
    print(f"{mutation.__name__}: {result.states} states: {result.finding.splitlines()[:1]}")
    assert result.finding
