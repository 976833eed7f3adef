"""Histories of faults between machines; ``hosts.histories`` plays more of them."""

from __future__ import annotations

import pytest
from network import repeats

from hosts.histories.history import HOSTS, Action, History, chain, mesh
from hosts.histories.play import play
from hosts.scripts import slack
from hosts.world import why_not

_WITHIN = 30.0
_WITHIN_AFTER_A_STOP = 10.0


@pytest.fixture(autouse=True)
def _namespaces() -> None:
    if reason := why_not():
        pytest.skip(reason)


@pytest.mark.timeout(600 * repeats(1, 11))
@pytest.mark.parametrize("neighbours", [mesh(HOSTS), chain(HOSTS)], ids=["mesh", "chain"])
@pytest.mark.parametrize("what", ["core", "node"])
def test_who_stood_still_is_back_soon(neighbours: dict[str, str], what: str) -> None:
    for _ in range(repeats(1, 11)):
        actions = [Action(1, "stop", "b", what), Action(13, "resume", "b", what)]
        result = play(History(neighbours, actions))
        print(f"{what} stopped for 12 s: together after {result.seconds} s")
        assert result.good, result
        assert result.seconds is not None
        assert result.seconds < _WITHIN_AFTER_A_STOP * slack()


@pytest.mark.parametrize("seed", range(207, 207 + repeats(1, 40)))
def test_all_come_together_after_a_history(seed: int) -> None:
    _check(History.of(seed))


@pytest.mark.parametrize("seed", range(2811, 2811 + repeats(1, 40)))
def test_writers_that_are_told_to_end_take_nothing_along(seed: int) -> None:
    _check(History.of(seed, "abcd", ends=True))


def _check(history: History) -> None:
    result = play(history)
    assert result.good, f"{history}: {result}"
    assert result.seconds is not None
    assert result.seconds < _WITHIN * slack()
