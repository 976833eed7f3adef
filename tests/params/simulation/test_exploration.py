"""Small worlds in every order; ``python -m tests.params.simulation --explore`` tries more."""

from __future__ import annotations

import os

import pytest

from . import mutations
from .mutations import Mutation, faulty
from .scripts import SCRIPTS, Script
from .search import explore
from .sweep import sweep
from .world import Setting

MOST = int(os.environ.get("ROSZ_EXAMPLES", "100")) * 3


@pytest.mark.parametrize("name", sorted(SCRIPTS))
def test_what_must_hold_holds_in_every_order(name: str) -> None:
    result = explore(SCRIPTS[name], MOST)
    print(f"{name}: {result}")
    assert not result.finding


@pytest.mark.parametrize("name", ["two", "two, loss", "two, stored"])
def test_a_sweep_reaches_what_a_search_reaches(name: str) -> None:
    _compare(SCRIPTS[name])


@pytest.mark.parametrize(
    ("machines", "calls", "cuts", "crashes"), [(2, 1, 0, 1), (2, 2, 1, 0), (3, 2, 0, 0)]
)
def test_a_sweep_reaches_it_despite_faults(
    machines: int, calls: int, cuts: int, crashes: int
) -> None:
    steps = SCRIPTS["two, four"].steps[:calls]
    _compare(Script(Setting(machines=machines, stored=1), steps, cuts, crashes, advances=0))


def _compare(script: Script) -> None:
    result, reference = sweep(script), explore(script)
    print(result)
    assert result.finished, result.finding
    assert reference.finished, reference.finding
    assert (result.states, result.moves) == (reference.states, reference.moves)
    assert result.finals == reference.finals
    assert len(result.finals) == result.ends > 0


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
def test_a_search_and_a_sweep_find_a_fault(mutation: Mutation, name: str) -> None:
    with faulty(mutation):
        results = explore(SCRIPTS[name], 2000), sweep(SCRIPTS[name], 10_000)
    for result in results:
        print(f"{mutation.__name__}: {result.states} states: {result.finding.splitlines()[:1]}")
    assert all(result.finding for result in results)


@pytest.mark.parametrize(
    ("mutation", "name", "last"),
    [
        (mutations.never_sends_again, "two, loss", "StoppedPeersFound"),
        (mutations.leaves_without_handing_over, "two, end", "WriteCalled"),
        (mutations.takes_an_acknowledgement_for_the_newest_batch, "two, four", "Publish"),
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_a_sweep_tells_what_led_to_a_fault(mutation: Mutation, name: str, last: str) -> None:
    with faulty(mutation):
        result = sweep(SCRIPTS[name], 2000)
    assert not result.finished
    assert last in result.finding.split("after:\n")[1]
