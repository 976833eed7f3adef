from __future__ import annotations

import logging
import threading
from itertools import pairwise
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT

from rosz.params.replica import Changed
from rosz.params.replica.core.effects import TreeChanged
from rosz.params.replica.watch import Watchers, is_same
from rosz.params.writes import DELETED, Write, put

from .network import Network, merge


def told(queue: SimpleQueue[Changed], count: int) -> list[tuple[str, Any, Any]]:
    changes = [queue.get(timeout=TIMEOUT) for _ in range(count)]
    return [(change.name, change.old, change.new) for change in changes]


def test_changes_come_with_name_old_new_and_origin(network: Network) -> None:
    one, other = network.replicas(2)
    heard: SimpleQueue[Changed] = SimpleQueue()
    other.watch("/a", heard.put)
    one.set("/a", 1)
    one.set("/a", 1.0)
    one.set("/a", {"b": 1, "c": 2})
    one.set("/a/b", 3)
    one.set("/unrelated", 1)
    one.delete("/a/c")
    one.set("/", {"a": {"b": 4}})
    one.delete("/a")
    first = heard.get(timeout=TIMEOUT)
    assert (first.name, first.old, first.new, first.origin) == ("/a", None, 1, "r0")
    assert first.time > 0
    assert told(heard, 6) == [
        ("/a", 1, 1.0),
        ("/a", 1.0, {"b": 1, "c": 2}),
        ("/a/b", 1, 3),
        ("/a/c", 2, None),
        ("/a", {"b": 3}, {"b": 4}),
        ("/a", {"b": 4}, None),
    ]


def test_setting_what_is_set_already_is_no_change(network: Network) -> None:
    one = network.replica()
    heard: SimpleQueue[Changed] = SimpleQueue()
    one.watch("/a", heard.put)
    for value in (1, 1, float("nan"), float("nan"), [True], [1]):
        one.set("/a", value)
    assert len(told(heard, 4)) == 4
    assert heard.empty()


def test_a_batch_tells_each_name_once(network: Network) -> None:
    one = network.replica()
    heard: SimpleQueue[Changed] = SimpleQueue()
    one.watch("/ns", heard.put)
    merge(one, "/", {"ns": {"a": 1, "b": {"c": 2}}, "other": 3})
    assert sorted(told(heard, 2)) == [("/ns/a", None, 1), ("/ns/b/c", None, 2)]


def test_a_watch_below_sees_what_is_written_above(network: Network) -> None:
    one = network.replica()
    heard: SimpleQueue[Changed] = SimpleQueue()
    one.watch("/a/b/c", heard.put)
    one.set("/a", {"b": {"c": 1}})
    one.set("/a/b", 5)
    one.set("/a", {"b": {"x": 1}})
    assert told(heard, 2) == [("/a/b/c", None, 1), ("/a/b/c", 1, None)]
    assert heard.empty()


def test_what_is_told_is_the_callbacks_own(network: Network) -> None:
    one = network.replica()
    done = threading.Event()

    def spoil(change: Changed) -> None:
        assert change.new == [1]
        change.new.append(9)
        done.set()

    one.watch("/a", spoil)
    one.set("/a", [1])
    assert done.wait(TIMEOUT)
    assert one.get("/a") == [1]


def test_callbacks_may_write_and_watch_and_end_their_watch(network: Network) -> None:
    one, other = network.replicas(2)
    done = threading.Event()

    def react(change: Changed) -> None:
        watch.close()
        one.set("/b", [change.new])
        one.watch("/c", lambda _: done.set())
        one.set("/c", 1)

    watch = one.watch("/a", react)
    other.set("/a", 1)
    assert done.wait(TIMEOUT)
    assert other.get("/b") == [1]


@pytest.mark.parametrize("kind", [ValueError, SystemExit])
def test_a_callback_that_fails_is_logged_and_harms_no_other(
    network: Network, caplog: pytest.LogCaptureFixture, kind: type[BaseException]
) -> None:
    def fail(_: Changed) -> None:
        raise kind("no")

    one = network.replica()
    heard: SimpleQueue[Changed] = SimpleQueue()
    one.watch("/a", fail)
    one.watch("/a", heard.put)
    with caplog.at_level(logging.ERROR, "rosz.params"):
        one.set("/a", 1)
        assert told(heard, 1) == [("/a", None, 1)]
    assert "the callback that watches '/a' failed on '/a'" in caplog.text


def test_a_callback_that_hangs_piles_nothing_up(network: Network) -> None:
    one = network.replica()
    heard: SimpleQueue[Changed] = SimpleQueue()
    go_on = threading.Event()

    def hang(change: Changed) -> None:
        heard.put(change)
        go_on.wait(TIMEOUT)

    one.watch("/a", hang)
    for number in range(100):
        one.set("/a", number)
    worker = one._runner.watchers._worker
    assert worker is not None
    waiting = worker._queue.qsize()
    go_on.set()
    assert waiting <= 1
    assert [heard.get(timeout=TIMEOUT).new for _ in range(100)] == list(range(100))


def test_a_closed_watch_hears_no_more(network: Network) -> None:
    one = network.replica()
    heard: SimpleQueue[Changed] = SimpleQueue()
    later: SimpleQueue[Changed] = SimpleQueue()
    with one.watch("/a", heard.put) as watch:
        assert watch.name == "/a"
        one.set("/a", 1)
        assert told(heard, 1) == [("/a", None, 1)]
    watch.close()
    one.watch("/a", later.put)
    one.set("/a", 2)
    assert told(later, 1) == [("/a", 1, 2)]
    assert heard.empty()


def test_a_deletion_below_a_leaf_tells_of_the_empty_dict() -> None:
    """Another replica deletes ``/a/b/c`` while this one sets ``/a/b``."""
    watchers = Watchers()
    heard: SimpleQueue[Changed] = SimpleQueue()
    for path in (("a",), ("a", "b"), ("a", "b", "c")):
        watchers.add(path, heard.put)
    write = put(("a", "b", "c"), (2, "c"), DELETED)
    watchers.notify(TreeChanged({"a": {"b": 10}}, {"a": {"b": {}}}, [write]))
    assert told(heard, 2) == [("/a/b", 10, {}), ("/a/b", 10, {})]
    watchers.close()
    assert heard.empty()


def test_a_slow_callback_gets_the_newest_of_each_name() -> None:
    watchers = Watchers()
    release, entered = threading.Event(), threading.Event()
    heard: SimpleQueue[Changed] = SimpleQueue()

    def slow(change: Changed) -> None:
        heard.put(change)
        entered.set()
        release.wait(TIMEOUT)

    watchers.add(("a",), slow)
    root: dict[str, Any] = {}
    for number in range(5000):
        write: Write = put(("a",), (number + 1, "c"), number)
        changed = {"a": number}
        watchers.notify(TreeChanged(root, changed, [write]))
        root = changed
        if number == 0:
            assert entered.wait(TIMEOUT)
    release.set()
    changes = [heard.get(timeout=TIMEOUT)]
    while changes[-1].new != 4999:
        changes.append(heard.get(timeout=TIMEOUT))
    assert len(changes) < 1100
    assert all(before.new == after.old for before, after in pairwise(changes))
    watchers.close()


def test_values_are_the_same_only_with_their_types() -> None:
    nan = float("nan")
    assert is_same({"a": [1, nan]}, {"a": [1, nan]})
    for left, right in [(1, True), (1, 1.0), ([1], [1, 2]), ({"a": 1}, {"b": 1}), ("1", 1)]:
        assert not is_same(left, right)
