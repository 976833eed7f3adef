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
from rosz.params.replica.core import Config, ReplicaCore
from rosz.params.replica.core.effects import Acknowledge, Reply
from rosz.params.replica.core.events import WriteCalled, WritesReceived
from rosz.params.replica.core.store import NOT_A_PARAMETER
from rosz.params.replica.runner import CoreRunner
from rosz.params.wire import Batch, Record, ReplicaMember, SyncRequest, add_header, encode
from rosz.params.writes import DELETED, Change, Write, put
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


class Shared(CoreRunner):
    """A core that is run by threads, and what it acknowledged."""

    def __init__(self) -> None:
        super().__init__(ReplicaCore(Config(ReplicaMember(1, "aa", "me"))), HybridClock("aa"))
        self.reasons: list[str] = []
        self.handlers |= {Acknowledge: self.note, Reply: self.note}

    def note(self, effect: Acknowledge | Reply) -> None:
        if isinstance(effect, Acknowledge):
            self.reasons.append(effect.reason)
        else:
            assert not isinstance(effect.reply, str)

    def take(self, message: bytes) -> str:
        """Apply a message; return why it is refused."""
        try:
            self.run(self.read_batch(message, ()))
        except DecodeError as error:
            self.report(NOT_A_PARAMETER, error)
            return str(error)
        return self.reasons.pop()

    def write(self, changes: list[Change], stamp: Stamp | None = None) -> int:
        """Write a batch; return its time."""
        outcome = self.call(
            lambda call, now: WriteCalled(
                call,
                changes,
                "me",
                (now.time, now.id) if stamp is None else (stamp.time, stamp.id),
                stamp is not None,
                0.0,
            )
        )
        return int(outcome.time)


def state() -> Shared:
    return Shared()


def stored(shared: CoreRunner) -> list[Write]:
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
                shared.take(data)
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
    apply = shared.core.history.apply

    def slowly(writes: list[Write]) -> list[Write]:
        entered.set()
        assert release.wait(TIMEOUT)
        return apply(writes)

    monkeypatch.setattr(shared.core.history, "apply", slowly)
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
    taken = [bool(shared.defer(message(f"n{at}", at, at + 1))) for at in range(100)]
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
    with shared.frozen():
        assert not shared.defer(message("a", 4, 4))
    assert shared.root == {"a": 3}


def test_taking_does_not_wait_for_others() -> None:
    shared = state()
    entered, release = threading.Event(), threading.Event()

    def work() -> None:
        shared._acquire()
        entered.set()
        assert release.wait(TIMEOUT)
        shared._release()

    other = threading.Thread(target=work)
    other.start()
    assert entered.wait(TIMEOUT)
    event = shared.read_batch(message("a", 1, 1), ())
    assert not shared.run(event, 0.002)
    release.set()
    other.join()
    assert shared.run(event, 0.002)
    assert shared.root == {"a": 1}


def test_what_may_have_been_deleted_is_refused() -> None:
    shared = state()
    shared.write([(("a",), 1)])
    time_ = shared.write([(("a",), DELETED)])
    with shared as history:
        assert history.forget(0) == 1
    early = message("a", 1, time_ - 1)
    assert not shared.defer(early)
    assert "older than deletions that are forgotten" in shared.take(early)
    with pytest.raises(DecodeError, match="older than deletions that are forgotten"):
        shared.write([(("a",), 1)], Stamp(time_ - 1, "bb"))
    assert shared.root == {}
    assert shared.defer(message("a", 1, time_ + 1))
    assert shared.root == {"a": 1}


def test_own_stamps_are_later_than_all_that_was_noted() -> None:
    shared = state()
    far = time.time_ns() + 9 * YEAR
    shared.defer(message("a", 1, far))
    assert shared.write([(("a",), 2)]) > far
    assert shared.root == {"a": 2}
    assert shared.stamp().time > far + 1


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
            shared.take(message("a", "taken", at))
            told = SyncRequest(records=[Record.of(put(("a",), (at, "bb"), "applied"))])
            shared.run(WritesReceived(1, told))
            with pytest.raises(DecodeError, match=r"'/a' of 'me' is stamped .* years ahead"):
                shared.write([(("a",), "written")], Stamp(at, "bb"))
        assert shared.root == {}
        shared.take(message("b", 1, now))
    assert shared.root == {"b": 1}
    assert max(clock, now) < shared.stamp().time < max(clock, now) + 10
    assert caplog.text.count("years ahead") == 1
    assert "'/a' of 'other' is stamped" in caplog.text


def test_damaged_messages_change_nothing(caplog: pytest.LogCaptureFixture) -> None:
    shared = state()
    with caplog.at_level(logging.WARNING, "rosz.params"):
        for data in (
            b"",
            add_header("bb", 1, b""),
            add_header("bb", 1, b"\xc1"),
            message("a//b", 1, 1),
        ):
            assert shared.defer(data) or shared.take(data)
        assert shared.root == {}
    assert caplog.text.count("wrote something that is not a parameter") == 3  # kinds of damage


def test_ctrl_c_while_messages_are_read_locks_nobody_out(monkeypatch: pytest.MonkeyPatch) -> None:
    shared = state()
    assert shared.defer(message("a", 1, 1))

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(shared, "_apply", interrupt)
        with pytest.raises(KeyboardInterrupt):
            _ = shared.root
    assert shared._acquire(0)
    shared._release()
    assert shared.root == {}


def test_a_signal_handler_in_the_midst_of_work_reads_what_was_and_is_refused_the_rest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shared = state()
    shared.write([(("a",), 1)])
    apply = shared.core.history.apply
    seen: list[Any] = []

    def interrupted(writes: list[Write]) -> list[Write]:
        shared.defer(message("b", 1, 1))
        seen.append(shared.root)
        for refused in (lambda: stored(shared), lambda: shared.write([(("a",), 3)])):
            with pytest.raises(ParamError, match="start a thread from it"):
                refused()
        return apply(writes)

    monkeypatch.setattr(shared.core.history, "apply", interrupted)
    writer = threading.Thread(target=lambda: shared.write([(("a",), 2)]), daemon=True)
    writer.start()
    writer.join(TIMEOUT)
    assert not writer.is_alive(), "the handler waits for the thread that it interrupted"
    monkeypatch.undo()
    assert seen == [{"a": 1}]
    assert shared.root == {"a": 2, "b": 1}
