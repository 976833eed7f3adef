from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest
from network import TIMEOUT

from rosz.errors import DecodeError, ParamError
from rosz.params.replica.state import State
from rosz.params.wire import Batch, add_header, encode
from rosz.params.writes import DELETED, Write, put
from rosz.session import HybridClock, Stamp

YEAR = 365 * 86_400 * 10**9
LATE = (1 << 62) - 1


@pytest.fixture
def hasty() -> Iterator[None]:
    """Let threads take turns as often as they can."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def state() -> State:
    return State(HybridClock("aa"))


def stored(shared: State) -> list[Write]:
    with shared as history:
        return list(history.writes())


def message(path: str, value: Any, time: int) -> bytes:
    batch = Batch.of((time, "bb"), "other", [(tuple(path.split("/")), value)])
    return add_header("bb", time, encode(batch))


@pytest.mark.usefixtures("hasty")
def test_what_was_noted_is_in_every_tree_read_afterwards() -> None:
    shared = state()
    wrong: list[tuple[str, int, Any]] = []
    stop = threading.Event()

    def note(name: str) -> None:
        for number in range(1, 1500):
            data = message(name, number, number)
            if not shared.defer(data):
                shared.receive(data)
            seen = shared.root.get(name)
            if seen != number:
                wrong.append((name, number, seen))

    def look() -> None:
        while not stop.is_set():
            shared.root  # noqa: B018  # reading is what is tried
            with shared as history:
                history.digest()

    lookers = [threading.Thread(target=look) for _ in range(2)]
    noters = [threading.Thread(target=note, args=(name,)) for name in ("a", "b")]
    for thread in (*lookers, *noters):
        thread.start()
    for thread in noters:
        thread.join()
    stop.set()
    for thread in lookers:
        thread.join()
    assert wrong == []
    assert shared.root == {"a": 1499, "b": 1499}


def test_a_read_waits_for_the_one_that_is_under_way(monkeypatch: pytest.MonkeyPatch) -> None:
    shared = state()
    entered, release = threading.Event(), threading.Event()
    apply = shared._history.apply

    def slowly(writes: list[Write]) -> list[Write]:
        entered.set()
        assert release.wait(TIMEOUT)
        return apply(writes)

    monkeypatch.setattr(shared._history, "apply", slowly)
    shared.defer(message("a", 1, 1))
    first = threading.Thread(target=shared.apply_deferred)
    first.start()
    assert entered.wait(TIMEOUT)
    seen: list[dict[str, Any]] = []
    second = threading.Thread(target=lambda: seen.append(shared.root))
    second.start()
    second.join(0.1)
    release.set()
    first.join()
    second.join()
    assert seen == [{"a": 1}]


def test_noting_has_an_end() -> None:
    shared = state()
    taken = [shared.defer(message(f"n{number}", number, number + 1)) for number in range(100)]
    assert taken == [True] * 64 + [False] * 36
    assert len(shared.root) == 64


def test_who_follows_is_served_at_once() -> None:
    shared = state()
    assert shared.defer(message("a", 1, 1))
    heard: list[object] = []
    watch = shared.watch(("a",), heard.append)
    assert not shared.defer(message("a", 2, 2))
    watch.close()
    assert shared.defer(message("a", 3, 3))
    shared.on_new(heard.append)
    assert not shared.defer(message("a", 4, 4))
    assert shared.root == {"a": 3}


def test_taking_does_not_wait_for_others() -> None:
    shared = state()
    entered, release = threading.Event(), threading.Event()

    def work() -> None:
        shared.acquire()
        entered.set()
        assert release.wait(TIMEOUT)
        shared.release()

    other = threading.Thread(target=work)
    other.start()
    assert entered.wait(TIMEOUT)
    assert shared.try_receive(message("a", 1, 1)) is None
    release.set()
    other.join()
    assert shared.try_receive(message("a", 1, 1)) == ""
    assert shared.root == {"a": 1}


def test_what_may_have_been_deleted_is_refused() -> None:
    shared = state()
    shared.write([(("a",), 1)], "me")
    stamp, _ = shared.write([(("a",), DELETED)], "me")
    assert shared.forget(0) == 1
    early = message("a", 1, stamp.time - 1)
    assert not shared.defer(early)
    assert "older than deletions that are forgotten" in shared.receive(early)
    with pytest.raises(DecodeError, match="older than deletions that are forgotten"):
        shared.write([(("a",), 1)], "me", Stamp(stamp.time - 1, "bb"))
    assert shared.root == {}
    assert shared.defer(message("a", 1, stamp.time + 1))
    assert shared.root == {"a": 1}


@pytest.mark.parametrize("seen", [{}, {"a": {"b": 1}}, {"a": 1}, {"a": {"b": {"c": 1}, "x": 1}}])
@pytest.mark.parametrize(
    "batch",
    [
        [(("a", "b", "c"), 2)],
        [(("a",), 2)],
        [((), {"a": 5, "z": 1})],
        [(("a", "b"), 2), (("a", "d", "e"), 3), (("a", "d", "f"), 3), (("q",), 4)],
        [(("a", "b"), DELETED)],
    ],
)
def test_undoing_restores_the_tree(seen: dict[str, Any], batch: list[Any]) -> None:
    shared = state()
    shared.write([((), seen)], "me")
    stamp, change = shared.write(batch, "me")
    shared.undo(change, stamp, "me")
    # In ROS 1 only what is set can be deleted, so the parents of a deletion are there already.
    assert shared.root == seen or batch[0][1] is DELETED


def test_undoing_leaves_what_came_later() -> None:
    shared = state()
    stamp, change = shared.write([(("a", "b"), 1), (("c",), 1)], "me")
    shared.write([(("a", "d"), 2), (("c",), 2)], "other")
    changes, _, _ = shared.undo(change, stamp, "me")
    assert changes == [(("a", "b"), DELETED)]
    assert shared.root == {"a": {"d": 2}, "c": 2}


def test_own_stamps_are_later_than_all_that_was_noted() -> None:
    shared = state()
    far = time.time_ns() + 9 * YEAR
    shared.defer(message("a", 1, far))
    stamp, change = shared.write([(("a",), 2)], "me")
    assert stamp > Stamp(far, "bb")
    assert change.new == {"a": 2}
    assert shared.stamp() > stamp


@pytest.mark.parametrize("clock", [0, 1_795_000_000 * 10**9])
def test_stamps_years_ahead_are_not_taken_in(
    clock: int, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A clock that lost its battery is years behind: what others stamp by theirs is believed."""
    monkeypatch.setattr(time, "time_ns", lambda: clock)
    shared = state()
    now = 1_795_000_000 * 10**9
    late = [LATE, (1 << 64) - 1, now + 11 * YEAR]
    with caplog.at_level(logging.WARNING, "rosz.params"):
        for at in late:
            shared.defer(message("a", "noted", at))
            shared.receive(message("a", "taken", at))
            assert shared.try_receive(message("a", "soon", at))
            shared.apply([put(("a",), (at, "bb"), "applied")])
            with pytest.raises(DecodeError, match=r"'/a' of 'me' is stamped .* years ahead"):
                shared.write([(("a",), "written")], "me", Stamp(at, "bb"))
        assert shared.root == {}
        shared.receive(message("b", 1, now))
    assert shared.root == {"b": 1}
    assert shared.stamp().time == max(clock, now) + 1
    assert caplog.text.count("years ahead") == 1
    assert "'/a' of 'other' is stamped" in caplog.text


def test_what_was_saved_years_ahead_counts_as_new(caplog: pytest.LogCaptureFixture) -> None:
    shared = state()
    saved = [
        put(("b",), (5, "bb"), "sound"),
        put(("a", "x"), (LATE, "bb"), "newest"),
        put(("a",), (LATE - 1, "bb"), {"x": "older", "y": 1}),
        put(("b",), (LATE, "bb"), DELETED),
    ]
    begun = time.time_ns()
    with caplog.at_level(logging.WARNING, "rosz.params"):
        assert shared.restore(saved)
    assert caplog.text.count("counts as written just now") == 1
    assert shared.root == {"a": {"x": "newest", "y": 1}}
    assert all(begun < write.time <= shared.stamp().time for write in stored(shared))
    assert shared.stamp().time < time.time_ns() + YEAR
    assert not shared.restore(stored(shared))


def test_damaged_messages_change_nothing(caplog: pytest.LogCaptureFixture) -> None:
    shared = state()
    with caplog.at_level(logging.WARNING, "rosz.params"):
        for data in (
            b"",
            add_header("bb", 1, b""),
            add_header("bb", 1, b"\xc1"),
            message("a//b", 1, 1),
        ):
            assert shared.defer(data) or shared.receive(data)
        assert shared.root == {}
    assert caplog.text.count("wrote something that is not a parameter") == 3  # kinds of damage


def test_ctrl_c_while_messages_are_read_locks_nobody_out(monkeypatch: pytest.MonkeyPatch) -> None:
    shared = state()
    assert shared.defer(message("a", 1, 1))

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(shared, "_receive", interrupt)
        with pytest.raises(KeyboardInterrupt):
            _ = shared.root
    assert shared.acquire(0)
    shared.release()
    assert shared.root == {}


def test_a_signal_handler_in_the_midst_of_work_reads_what_was_and_is_refused_the_rest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shared = state()
    shared.write([(("a",), 1)], "me")
    apply = shared._history.apply
    seen: list[Any] = []

    def interrupted(writes: list[Write]) -> list[Write]:
        shared.defer(message("b", 1, 1))
        seen.append(shared.root)
        for refused in (lambda: stored(shared), lambda: shared.write([(("a",), 3)], "handler")):
            with pytest.raises(ParamError, match="start a thread from it"):
                refused()
        return apply(writes)

    monkeypatch.setattr(shared._history, "apply", interrupted)
    writer = threading.Thread(target=lambda: shared.write([(("a",), 2)], "me"), daemon=True)
    writer.start()
    writer.join(TIMEOUT)
    assert not writer.is_alive(), "the handler waits for the thread that it interrupted"
    monkeypatch.undo()
    assert seen == [{"a": 1}]
    assert shared.root == {"a": 2, "b": 1}
