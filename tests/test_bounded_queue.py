"""The queue whose oldest items make room for new ones."""

from __future__ import annotations

import pytest

from rosz.queue import BoundedQueue


def test_the_oldest_items_make_room_by_number() -> None:
    queue: BoundedQueue[str] = BoundedQueue(most=2)
    assert [list(queue.put(item)) for item in "abcd"] == [[], [], ["a"], ["b"]]
    assert list(queue) == ["c", "d"]
    assert queue.dropped == 2


def test_the_oldest_items_make_room_by_size() -> None:
    queue: BoundedQueue[str] = BoundedQueue(most_bytes=10)
    for item, size in ("a", 4), ("b", 4), ("c", 2):
        assert queue.put(item, size) == ()
    assert list(queue.put("d", 5)) == ["a", "b"]
    assert (list(queue), queue.size, queue.dropped) == (["c", "d"], 7, 2)


def test_the_newest_item_stays_whatever_its_size() -> None:
    queue: BoundedQueue[str] = BoundedQueue(most=3, most_bytes=10)
    queue.put("a", 1)
    assert list(queue.put("huge", 100)) == ["a"]
    assert (queue.oldest, queue.size) == ("huge", 100)
    assert list(queue.put("b", 1)) == ["huge"]


def test_a_queue_without_limits_drops_nothing() -> None:
    queue: BoundedQueue[int] = BoundedQueue()
    for number in range(1000):
        assert queue.put(number, number) == ()
    assert (len(queue), queue.dropped) == (1000, 0)


def test_items_leave_in_their_order() -> None:
    queue: BoundedQueue[str] = BoundedQueue(most_bytes=10)
    queue.put("a", 3)
    queue.put("b", 4)
    assert (queue.pop(), queue.size) == ("a", 4)
    queue.clear()
    assert (len(queue), queue.size, queue.dropped) == (0, 0, 0)
    with pytest.raises(IndexError):
        queue.pop()
    with pytest.raises(IndexError):
        _ = queue.oldest


def test_a_new_limit_holds_from_the_next_item_on() -> None:
    queue: BoundedQueue[int] = BoundedQueue(most=5)
    for number in range(5):
        queue.put(number)
    queue.most = 2
    assert len(queue) == 5
    assert list(queue.put(5)) == [0, 1, 2, 3]
