from __future__ import annotations

import random
from itertools import combinations
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rosz.errors import ParamError
from rosz.params.history import History
from rosz.params.tree import MISSING, leaves, lookup
from rosz.params.values import MAX_DEPTH
from rosz.params.writes import DELETED, Write, check_write, condense, put

from .oracle import replay
from .strategies import DICTS, PATHS, VALUES, shared, writes


def of(*batches: list[Write]) -> History:
    history = History()
    for batch in batches:
        history.apply(batch)
    return history


def kept(history: History) -> set[tuple[Any, ...]]:
    return {(write.path, write.time, write.clock) for write in history.writes()}


def is_same(left: History, right: History) -> bool:
    return (
        left.root == right.root
        and kept(left) == kept(right)
        and left.digest() == right.digest()
        and len(left) == len(right) == len(kept(left))
    )


@given(writes(), st.randoms(use_true_random=False))
def test_the_tree_is_the_replay_whatever_the_order(
    batch: list[Write], chance: random.Random
) -> None:
    shuffled = chance.sample(batch, len(batch))
    one_by_one = of(*([write] for write in shuffled))
    assert one_by_one.root == replay(batch)
    assert is_same(one_by_one, of(batch))


@given(shared(2))
def test_merging_commutes(seen: list[list[Write]]) -> None:
    left, right = seen
    assert is_same(of(left, right), of(right, left))


@given(shared(3))
def test_merging_is_associative(seen: list[list[Write]]) -> None:
    one, two, three = seen
    left = of(list(of(one, two).writes()), three)
    right = of(one, list(of(two, three).writes()))
    assert is_same(left, right)


@given(writes())
def test_applying_again_is_no_news(batch: list[Write]) -> None:
    history = of(batch)
    root, digest = history.root, history.digest()
    assert history.apply(batch) == []
    assert history.root == root
    assert history.digest() == digest


@given(writes())
def test_what_is_dropped_is_what_is_hidden(batch: list[Write]) -> None:
    history = of(batch)
    newest = {(write.path, write.time, write.clock) for write in batch if not _hidden(write, batch)}
    assert kept(history) == newest
    assert all(history.hides(write) for write in batch)


def _hidden(write: Write, others: list[Write]) -> bool:
    return any(
        other.order > write.order and write.path[: len(other.path)] == other.path
        for other in others
    )


@given(shared(2))
def test_dropped_writes_leave_no_trace_in_what_comes_later(seen: list[list[Write]]) -> None:
    first, then = seen
    pruned = of(list(of(first).writes()), then)
    assert pruned.root == replay([*first, *then])


@given(writes())
def test_roots_once_seen_never_change(batch: list[Write]) -> None:
    history = History()
    seen: list[tuple[Any, Any]] = []
    for write in batch:
        history.apply([write])
        seen.append((history.root, replay(batch[: len(seen) + 1])))
    for root, expected in seen:
        assert root == expected


@given(st.lists(st.tuples(PATHS, st.one_of(st.just(DELETED), VALUES)), max_size=8))
def test_a_batch_does_what_its_steps_do(steps: list[tuple[Any, Any]]) -> None:
    steps = [
        (path, {} if not path and not isinstance(value, dict) else value) for path, value in steps
    ]
    stepwise = of([put(path, (time, "c"), value) for time, (path, value) in enumerate(steps, 1)])
    batch = [put(path, (1, "c"), value) for path, value in condense(steps)]
    assert of(batch).root == stepwise.root
    assert of(*([write] for write in reversed(batch))).root == stepwise.root


@given(writes(), st.integers(0, 4))
def test_forgetting_changes_nothing_now(batch: list[Write], keep: int) -> None:
    history = of(batch)
    gone = history.forget(keep)
    assert history.root == replay(batch)
    assert history.root == replay(history.writes())
    assert len(history) == len(of(batch)) - gone
    assert is_same(history, of(list(history.writes())))


@given(shared(2), st.integers(0, 4))
def test_forgetting_changes_nothing_for_younger_writes(seen: list[list[Write]], keep: int) -> None:
    batch, late = seen
    forgetful = of(batch)
    forgetful.forget(keep)
    late = [write for write in late if write.time > forgetful.horizon]
    forgetful.apply(late)
    assert forgetful.root == replay([*batch, *late])


@given(shared(2), st.integers(0, 4))
def test_nothing_unproven_before_the_horizon_is_added(seen: list[list[Write]], keep: int) -> None:
    batch, late = seen
    forgetful = of(batch)
    forgetful.forget(keep)
    for write in late:
        if write.time <= forgetful.horizon and forgetful.provable(write) is None:
            before = kept(forgetful)
            assert forgetful.apply([write]) == []
            assert kept(forgetful) == before


def test_an_older_write_proves_that_nothing_was_deleted_since() -> None:
    history = of([put((name,), (time, "c"), time) for time, name in enumerate("abcd", 1)])
    history.apply([put(("d",), (9, "c"), DELETED)])
    assert (history.forget(0), history.horizon) == (1, 9)
    history.apply([put(("a",), (5, "e"), "set"), put(("b",), (5, "e"), DELETED)])
    history.apply([put(("d",), (8, "e"), "deleted since"), put(("new",), (8, "e"), "perhaps, too")])
    history.apply([put(("c",), (6, "e"), {"x": "perhaps deleted since"})])
    assert history.root == {"a": "set"}


@given(
    shared(3),
    st.lists(st.integers(0, 4), min_size=3, max_size=3),
    st.permutations(list(combinations(range(3), 2))),
)
@example(
    # The first set proves the third one's write, until the second one removes the proof.
    [
        [put((), (9, "a"), {}), put(("b",), (19, "a"), DELETED)],
        [put(("b",), (17, "a"), DELETED)],
        [put((), (18, "a"), {})],
    ],
    [0, 0, 1],
    [(0, 2), (0, 1), (1, 2)],
)
def test_sets_that_merge_each_other_become_one(
    seen: list[list[Write]], keeps: list[int], pairs: list[tuple[int, int]]
) -> None:
    sets = [of(batch) for batch in seen]
    for history, keep in zip(sets, keeps, strict=True):
        history.forget(keep)
    for left, right in pairs * 2:
        one, other = sets[left], sets[right]
        ours = list(one.writes()), one.horizon
        one.merge(other.writes(), other.horizon)
        other.merge(*ours)
        assert is_same(one, other)
        assert one.horizon == other.horizon
    first, *others = sets
    for other in others:
        assert is_same(first, other)
    assert first.root == replay(first.writes())


def test_remembered_deletions_are_bounded() -> None:
    history = History()
    for time in range(1, 3001):
        path = ("ns", f"n{time}")
        history.apply([put(path, (2 * time, "a"), time)])
        history.apply([put(path, (2 * time + 1, "a"), DELETED)])
        if time % 10 == 0:
            history.forget(50)
            assert min(50, time) <= len(history) <= 100
    assert history.root == {"ns": {}}
    assert history.horizon > 2 * 2900 - 200
    history.forget(0)
    assert len(history) == 1
    assert history.root == {"ns": {}}


def test_a_deletion_that_cuts_a_part_from_a_whole_dict_stays() -> None:
    history = of([put(("a",), (1, "c"), {"x": 1, "y": 2}), put(("a", "x"), (2, "c"), DELETED)])
    assert history.forget(0) == 0
    assert history.horizon == 0
    assert history.root == {"a": {"y": 2}}


def test_an_older_put_stays_dead_under_a_remembered_deletion() -> None:
    history = of([put(("a",), (5, "c"), DELETED)])
    assert history.apply([put(("a", "b"), (4, "d"), 1)]) == []
    assert history.root == {}


def test_a_leaf_that_became_a_dict_stays_one_when_its_child_goes() -> None:
    history = of([put(("a",), (1, "c"), 5)], [put(("a", "b"), (2, "c"), 1)])
    history.apply([put(("a", "b"), (3, "c"), DELETED)])
    assert history.root == {"a": {}}
    history.forget(0)
    assert history.root == {"a": {}}


@given(writes())
def test_the_source_of_a_value_is_its_write(batch: list[Write]) -> None:
    history = of(batch)
    for path, value in leaves(history.root):
        if not path:
            continue
        source = history.source(path)
        assert source is not None
        found = lookup(source.value, path[len(source.path) :])
        assert found == value
        assert type(found) is type(value)


def test_find_returns_only_the_write_at_the_path_itself() -> None:
    history = of([put(("a",), (1, "c"), {"b": 1})])
    assert history.find(("a", "b")) is None
    assert history.find(("q", "r")) is None
    found = history.find(("a",))
    assert found is not None
    assert found.value == {"b": 1}


@given(shared(2))
def test_buckets_tell_what_differs(seen: list[list[Write]]) -> None:
    left, right = seen
    ours, theirs = of(left), of(right)
    differing = set(ours.differing(theirs.digest()))
    for index in range(64):
        mine = {write.order for write in ours.in_buckets([index])}
        other = {write.order for write in theirs.in_buckets([index])}
        assert (index in differing) == (mine != other)


def test_the_root_is_a_dict_and_paths_have_an_end() -> None:
    history = History()
    with pytest.raises(ParamError, match="'/' cannot be the int 5"):
        put((), (1, "c"), 5)
    with pytest.raises(ParamError, match="has 101 parts"):
        put(("a",) * (MAX_DEPTH + 1), (1, "c"), 5)
    bad = Write((), 1, "c", 5)
    with pytest.raises(ParamError):
        history.apply([put(("a",), (1, "c"), 1), bad])
    assert history.root == {}
    check_write(("a",) * MAX_DEPTH, 1)


def test_deleting_the_root_empties_it() -> None:
    history = of([put(("a",), (1, "c"), 1)])
    history.apply([put((), (2, "c"), DELETED)])
    assert history.root == {}
    assert len(history) == 1


@given(DICTS)
def test_leaves_and_lookup_agree(tree: dict[str, Any]) -> None:
    for path, value in leaves(tree):
        assert lookup(tree, path) is value
    assert lookup(tree, ("nowhere",)) is MISSING
    assert lookup({"a": "text"}, ("a", "b")) is MISSING
    assert lookup({"a": [1]}, ("a", "0")) is MISSING
