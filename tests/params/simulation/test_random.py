"""Random histories; ``python -m tests.params.simulation`` plays more of them."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from .histories import DELAYS, KINDS, Action, draw_setting, play, play_seed
from .world import Setting

ACTIONS = st.builds(
    Action,
    st.sampled_from(sorted(KINDS)),
    st.integers(0, 4),
    st.integers(0, 63),
    st.integers(0, len(DELAYS) - 1),
)
SETTINGS = st.integers(0, 1 << 32).map(lambda seed: draw_setting(random.Random(seed)))


@given(SETTINGS, st.integers(0, 1 << 32), st.lists(ACTIONS, max_size=40))
def test_what_must_hold_holds(setting: Setting, seed: int, actions: list[Action]) -> None:
    play(setting, seed, actions)


@pytest.mark.parametrize(
    ("seed", "length", "rounds"),
    [
        *((227, 40, 1), (611, 40, 1), (786, 40, 1), (2233, 40, 1), (2870001056, 90, 2)),
        *((810000025, 90, 2), (810001706, 90, 2)),
    ],
)
def test_what_once_failed_holds(seed: int, length: int, rounds: int) -> None:
    play_seed(seed, length, rounds)


def test_a_long_history_holds() -> None:
    play_seed(7, 60, rounds=8)
