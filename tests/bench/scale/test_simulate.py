"""The simulation beside the crowds that it was fitted to, and beside what can be reckoned."""

from __future__ import annotations

import msgspec
import pytest

from .sight import Sight
from .simulate import HOSTS, Costs, again, knee, load, measured, simulate

CROWDS = [one for one in load() if one.mode in HOSTS]
COSTS = Costs.fit(CROWDS)
TICKS = 0.02
"""Seconds of a core that are not seen: Linux counts in ticks, in user and in system mode."""
ALONE = Costs(
    start=0.1, hears=0.0, serves=0.01, routes=0.0, relays=0.002, own=10.0, other=0.5, across=3.0
)


@pytest.mark.parametrize("sight", CROWDS, ids=lambda one: f"{one.count} {one.mode}")
def test_crowds_come_out_as_they_were_measured(sight: Sight) -> None:
    found, real = again(COSTS, sight), measured(sight)
    assert found.complete == pytest.approx(real.complete, rel=0.25)
    assert found.busy == pytest.approx(real.busy, rel=0.2)
    assert found.core == pytest.approx(real.core, rel=0.35, abs=TICKS)
    assert found.traffic == pytest.approx(real.traffic, rel=0.35)


def test_nodes_that_hear_of_nobody() -> None:
    """Two processors start 20 nodes in turn; the core takes what is left of its time."""
    found = simulate(ALONE, 20)
    assert found.busy == pytest.approx(0.11)
    assert found.core == pytest.approx(0.2)
    assert 1.1 <= found.complete <= 1.1 + 0.1 + 0.01
    assert found.traffic == pytest.approx(20.0)


def test_each_core_learns_of_the_nodes_of_all_others() -> None:
    found = simulate(ALONE, 60, machines=6)
    assert found.core == pytest.approx(10 * 0.01 + 50 * 0.002)
    assert found.busy == pytest.approx(0.1 + 0.01 + 5 * 0.002)
    assert found.traffic == pytest.approx(15.0)


def test_the_knee() -> None:
    """Twice as many nodes cost more than four times as much beyond it, and less before."""
    costs = msgspec.structs.replace(ALONE, hears=0.001)
    place = knee(costs, 1)
    assert simulate(costs, place).busy == pytest.approx(2 * simulate(ALONE, place).busy, rel=0.01)
