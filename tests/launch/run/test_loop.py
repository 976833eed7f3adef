"""The loop calls functions in order, and reports every event."""

from __future__ import annotations

import os
import subprocess
import sys
import threading

import pytest

from rosz.launch.run.loop import Loop

from .in_thread import TIMEOUT


@pytest.fixture
def loop() -> Loop:
    return Loop()


def test_timers_run_in_order_and_can_be_cancelled(
    loop: Loop, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[str] = []
    began = loop.now()
    with monkeypatch.context() as patch:
        patch.setattr(loop, "now", lambda: began)  # however long the machine looks away
        loop.later(0.02, lambda: seen.append("second"))
        loop.later(0.01, lambda: seen.append("first"))
        loop.later(0.015, lambda: seen.append("never")).cancel()
        loop.later(0.03, loop.stop)
    loop.run()
    assert seen == ["first", "second"]
    loop.close()


@pytest.mark.parametrize("seconds", [1e8, 1e300, float("inf")])
def test_a_timer_far_away_is_waited_for(loop: Loop, seconds: float) -> None:
    loop.later(seconds, lambda: pytest.fail("too early"))
    thread = threading.Timer(0.05, lambda: loop.post(loop.stop))
    thread.start()
    loop.run()
    thread.join()
    loop.close()


def test_timers_of_one_moment_keep_their_order(loop: Loop) -> None:
    seen: list[int] = []
    for number in range(20):
        loop.later(0.0, lambda number=number: seen.append(number))  # type: ignore[misc]
    loop.later(0.0, loop.stop)
    loop.run()
    assert seen == list(range(20))
    loop.close()


def test_other_threads_wake_it(loop: Loop) -> None:
    thread = threading.Thread(target=lambda: loop.post(loop.stop))
    loop.later(TIMEOUT, lambda: pytest.fail("not woken"))
    thread.start()
    loop.run()
    thread.join()
    loop.close()


def test_a_stop_before_the_run_counts(loop: Loop) -> None:
    loop.stop()
    loop.run()
    loop.close()


def test_a_post_after_the_close_is_harmless(loop: Loop) -> None:
    loop.close()
    loop.post(loop.stop)
    loop.close()


def test_many_posts_all_run(loop: Loop) -> None:
    seen: list[int] = []

    def work() -> None:
        for number in range(10000):
            loop.post(lambda number=number: seen.append(number))  # type: ignore[misc]
        loop.post(loop.stop)

    thread = threading.Thread(target=work)
    thread.start()
    loop.run()
    thread.join()
    assert seen == list(range(10000))
    loop.close()


def test_a_watch_ended_in_the_same_round_is_not_called(loop: Loop) -> None:
    seen: list[int] = []
    pairs = [os.pipe() for _ in range(2)]

    def read(number: int) -> None:
        seen.append(number)
        for ours, _ in pairs:
            loop.unwatch(ours)
        loop.stop()

    for number, (ours, theirs) in enumerate(pairs):
        os.write(theirs, b"x")
        loop.watch(ours, lambda number=number: read(number))  # type: ignore[misc]
    loop.run()
    assert len(seen) == 1
    loop.close()
    for pair in pairs:
        for fd in pair:
            os.close(fd)


@pytest.mark.parametrize("pidfd", [True, False])
def test_the_end_of_a_child_is_reported(
    loop: Loop, monkeypatch: pytest.MonkeyPatch, *, pidfd: bool
) -> None:
    if not pidfd:
        monkeypatch.delattr(os, "pidfd_open")
    child = subprocess.Popen([sys.executable, "-S", "-c", "input()"], stdin=subprocess.PIPE)
    loop.watch_exit(child.pid, loop.stop)
    assert child.stdin is not None
    child.stdin.close()
    loop.run()
    assert child.wait(TIMEOUT) == 1
    loop.close()
