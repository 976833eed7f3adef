"""The checks find deliberate faults of the core, each by a history that follows from a seed."""

from __future__ import annotations

import itertools
import os

import pytest

from .histories import play_seed
from .mutations import MUTATIONS, Mutation, first_found

# Where each shows, so that the test is quick; others are tried if the core has changed since.
SEEDS = {
    "acknowledges_before_the_disk": 0,
    "answers_before_the_own_disk": 7,
    "forgets_what_a_full_disk_refused": 8,
    "compacts_without_the_newest_write": 7,
    "takes_any_end_of_a_save_for_success": 8,
    "undoes_what_is_not_kept_everywhere": 8,
    "forgets_its_horizon": 2,
    "tells_no_horizon": 214,
    "has_digests_without_stamps": 4,
    "counts_an_acknowledgement_twice": 19,
    "takes_an_acknowledgement_for_the_newest_batch": 5,
    "counts_a_lagging_replica_as_holder": 2,
    "does_not_name_the_lagging": 13,
    "never_sends_again": 4,
    "waits_without_a_limit": 2,
    "does_not_wait_for_the_last_one": 5,
    "never_forgets_a_member": 2,
    "does_not_notice_that_it_stood_still": 872,
    "does_not_miss_whom_it_lost": 37,
    "takes_who_is_lost_for_one_that_left": 37,
    "leaves_without_handing_over": 12,
    "joins_too_early": 1,
    "never_sends_what_others_lack": 87,
    "never_compares_of_its_own": 143,
    "calls_any_comparison_good": 352,
}
LONG = {"acknowledges_what_it_refuses": 27, "drops_without_a_word": 9}
"""Those that show only after many deletions."""
MOST = int(os.environ.get("ROSZ_EXAMPLES", "100")) * 8


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
def test_a_fault_is_found(mutation: Mutation) -> None:
    name = mutation.__name__
    length, rounds = (60, 6) if name in LONG else (40, 1)
    first = (LONG | SEEDS).get(name, 0)
    seeds = itertools.chain([first], range(MOST))
    found = first_found(mutation, lambda seed: play_seed(seed, length, rounds), seeds)
    assert found.seed >= 0
    print(f"{name}: seed {found.seed}: {found.text}")


@pytest.mark.parametrize(("seeds", "rounds"), [(set(SEEDS.values()), 1), (set(LONG.values()), 6)])
def test_the_core_itself_passes(seeds: set[int], rounds: int) -> None:
    for seed in sorted(seeds):
        play_seed(seed, 60 if rounds > 1 else 40, rounds)
