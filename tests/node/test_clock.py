from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from network import TIMEOUT
from simulation import SECOND, START, Beds, SimulatedClock, Task

from rosz.errors import TimeMovedBackwards, UsageError
from rosz.node.clock import Clock, TimeJump


def test_wall_time_is_the_systems() -> None:
    clock = Clock()
    before = time.time_ns()
    assert before <= clock.now() <= time.time_ns()
    assert not clock.simulated


def test_intervals_of_wall_time_are_monotonic(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()
    monkeypatch.setattr(time, "time_ns", lambda: 5)
    before = time.monotonic_ns()
    assert before <= clock.steady() <= time.monotonic_ns()
    assert clock.now() == 5


def test_simulated_time_is_zero_until_the_first_tick() -> None:
    clock = Clock()
    clock.enable_simulation()
    assert clock.simulated
    assert clock.now() == 0
    clock.advance(START)
    assert clock.now() == clock.steady() == START


def test_advancing_needs_simulation() -> None:
    with pytest.raises(UsageError, match=r"not simulated: call enable_simulation"):
        Clock().advance(START)


def test_time_cannot_be_negative() -> None:
    with pytest.raises(UsageError, match="'-1' ns: expected 0 or more"):
        SimulatedClock().advance(-1)


def test_wall_sleep_lasts() -> None:
    before = time.monotonic_ns()
    assert Clock().sleep(2_000_000)
    assert time.monotonic_ns() - before >= 2_000_000


def test_wall_sleep_until_a_time() -> None:
    until = time.time_ns() + 2_000_000
    assert Clock().sleep_until(until)
    assert time.time_ns() >= until


@pytest.mark.parametrize("duration", [0, -1, -(10**30)])
def test_nothing_to_sleep_for(duration: int) -> None:
    assert Clock().sleep(duration)
    assert SimulatedClock().sleep(duration)


def test_setting_the_wall_clock_does_not_prolong_a_sleep(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()
    times = iter([START])
    monkeypatch.setattr(time, "time_ns", lambda: next(times))
    assert clock.sleep_until(START + 1_000_000)


def test_closing_ends_a_wall_sleep_at_once() -> None:
    clock = Clock()
    beds = clock._source.sleepers = Beds()
    task = Task(lambda: clock.sleep(10**30))
    assert beds.taken.acquire(timeout=TIMEOUT)
    clock.close()
    assert task.result() is False


def test_closed_clock_does_not_sleep() -> None:
    wall, simulated = Clock(), SimulatedClock()
    unstarted = SimulatedClock(0)
    for clock in (wall, simulated, unstarted):
        clock.close()
        clock.close()
        assert clock.closed
        assert clock.sleep(10**12) is False
        assert clock.sleep(0) is False
        assert clock.sleep_until(clock.now() + 10**12) is False
        assert clock.wait_started() is False


def test_simulated_sleep_wakes_when_its_time_comes() -> None:
    clock = SimulatedClock()
    task = clock.asleep(lambda: clock.sleep(10 * SECOND))
    clock.advance(START + 10 * SECOND - 1)
    assert not task.done
    assert len(clock.beds) == 1
    clock.advance(START + 10 * SECOND)
    assert task.result() is True
    assert not clock.beds


def test_tick_wakes_only_those_whose_time_has_come() -> None:
    clock = SimulatedClock()
    early = clock.asleep(lambda: clock.sleep_until(START + 1))
    late = clock.asleep(lambda: clock.sleep_until(START + 3))
    clock.advance(START + 2)
    assert early.result() is True
    assert len(clock.beds) == 1
    clock.advance(START + 3)
    assert late.result() is True


def test_leap_forward_ends_a_sleep() -> None:
    clock = SimulatedClock()
    task = clock.asleep(lambda: clock.sleep(SECOND))
    clock.advance(START * 1000)
    assert task.result() is True


def test_sleep_before_the_first_tick_counts_from_it() -> None:
    clock = SimulatedClock(0)
    task = clock.asleep(lambda: clock.sleep(SECOND))
    clock.advance(0)
    assert len(clock.beds) == 1
    clock.advance(START)
    clock.wait_for_sleeper()
    assert not task.done
    clock.advance(START + SECOND)
    assert task.result() is True


def test_waiting_for_the_first_tick() -> None:
    assert Clock().wait_started()
    assert SimulatedClock().wait_started()
    clock = SimulatedClock(0)
    task = clock.asleep(clock.wait_started)
    clock.advance(1)
    assert task.result() is True


def test_time_that_moves_back_ends_a_sleep_with_an_error() -> None:
    clock = SimulatedClock()
    task = clock.asleep(lambda: clock.sleep(SECOND))
    clock.advance(START - 5 * SECOND)
    with pytest.raises(TimeMovedBackwards, match="backwards by 5 s") as caught:
        task.result()
    assert (caught.value.before, caught.value.after) == (START, START - 5 * SECOND)


def test_moving_back_to_no_earlier_than_the_start_of_a_sleep_is_not_noticed() -> None:
    clock = SimulatedClock()
    task = clock.asleep(lambda: clock.sleep(10 * SECOND))
    clock.advance(START + 9 * SECOND)
    clock.advance(START)
    assert len(clock.beds) == 1
    clock.advance(START + 10 * SECOND)
    assert task.result() is True


@pytest.mark.parametrize("start", [0, START])
def test_closing_ends_a_simulated_sleep_at_once(start: int) -> None:
    clock = SimulatedClock(start)
    task = clock.asleep(lambda: clock.sleep(SECOND))
    clock.close()
    assert task.result() is False


def test_many_sleepers_are_all_woken() -> None:
    clock = SimulatedClock()
    tasks = []
    for count in range(1, 51):
        tasks.append(Task(lambda count=count: clock.sleep(count)))  # type: ignore[misc]
        clock.wait_for_sleeper()
    for count in range(1, 51):
        clock.advance(START + count)
    assert all(task.result() for task in tasks)


def test_branch_shares_time_and_closes_alone() -> None:
    clock = SimulatedClock()
    branch, sibling = clock.branch(), clock.branch()
    ended = clock.asleep(lambda: branch.sleep(SECOND))
    spared = clock.asleep(lambda: sibling.sleep(SECOND))
    branch.close()
    assert ended.result() is False
    assert branch.closed
    assert not clock.closed
    assert not sibling.closed
    sibling.advance(START + SECOND)
    assert clock.now() == branch.now() == START + SECOND
    assert spared.result() is True


def test_closing_ends_the_sleeps_of_branches_of_branches() -> None:
    clock = SimulatedClock()
    twig = clock.branch().branch()
    task = clock.asleep(lambda: twig.sleep(SECOND))
    clock.close()
    assert task.result() is False
    assert twig.closed
    assert clock.branch().closed


def test_wall_sleeps_under_way_keep_to_wall_time() -> None:
    clock = Clock()
    beds = clock._source.sleepers = Beds()
    task = Task(lambda: clock.sleep(20_000_000))
    assert beds.taken.acquire(timeout=TIMEOUT)
    clock.enable_simulation()
    clock.advance(1)
    assert task.result() is True


class Interrupted(Beds):
    """Do what a signal handler may do while a sleep begins."""

    def __init__(self, handler: Callable[[], None]) -> None:
        super().__init__()
        self._handler = handler

    def add(self, element: Any, /) -> None:
        self._handler()
        super().add(element)
        self._handler()


@pytest.mark.parametrize("simulated", [True, False])
def test_closing_while_the_same_thread_falls_asleep(simulated: bool) -> None:
    clock = SimulatedClock() if simulated else Clock()
    clock._source.sleepers = Interrupted(clock.close)
    assert clock.sleep(10**30) is False


@contextmanager
def signals_to_this_thread(handler: Callable[..., None], clock: SimulatedClock) -> Iterator[None]:
    """Send signals from the first sleep to the end of the block.

    One is not always enough: Python sees it only later if it comes just before a thread blocks.
    """
    before = signal.signal(signal.SIGUSR1, handler)
    main = threading.main_thread().ident
    assert main is not None
    over = threading.Event()

    def interrupt() -> None:
        clock.wait_for_sleeper()
        while not over.wait(0.01):
            signal.pthread_kill(main, signal.SIGUSR1)

    task = Task(interrupt)
    try:
        yield
    finally:
        over.set()
        task.result()
        signal.signal(signal.SIGUSR1, before)


def test_closing_from_a_signal_handler_during_a_sleep() -> None:
    clock = SimulatedClock()
    with signals_to_this_thread(lambda *_: clock.close(), clock):
        assert clock.sleep(SECOND) is False


def test_error_from_a_signal_handler_leaves_no_sleeper_behind() -> None:
    clock = SimulatedClock()
    raised = False

    def handler(*_: object) -> None:
        nonlocal raised
        if not raised:
            raised = True
            raise KeyboardInterrupt

    with signals_to_this_thread(handler, clock), pytest.raises(KeyboardInterrupt):
        clock.sleep(SECOND)
    assert not clock.beds


def test_observers_hear_of_jumps_back() -> None:
    clock = SimulatedClock(0)
    jumps: list[TimeJump] = []
    withdraw = clock.branch().on_jump(jumps.append)
    for moment in (START, START + SECOND, START * 9, START, START, START - 1):
        clock.advance(moment)
    assert jumps == [TimeJump(START * 9, START), TimeJump(START, START - 1)]
    assert jumps[1].delta == -1
    withdraw()
    withdraw()
    clock.advance(1)
    assert len(jumps) == 2


def test_observers_hear_of_leaps_forward_when_asked() -> None:
    clock = SimulatedClock(0)
    jumps: list[TimeJump] = []
    clock.on_jump(jumps.append, wanted=lambda jump: jump.delta >= SECOND or jump.delta < 0)
    for moment in (START, START + SECOND - 1, START + 2 * SECOND - 1, START):
        clock.advance(moment)
    assert [jump.delta for jump in jumps] == [SECOND, -(2 * SECOND - 1)]


def test_all_observers_are_called_though_one_fails() -> None:
    clock = SimulatedClock()
    jumps: list[TimeJump] = []

    def fail(_: TimeJump) -> None:
        raise ValueError("no")

    clock.on_jump(fail)
    clock.on_jump(jumps.append)
    with pytest.raises(ExceptionGroup) as caught:
        clock.advance(1)
    assert [str(error) for error in caught.value.exceptions] == ["no"]
    assert jumps == [TimeJump(START, 1)]


def test_observer_may_use_the_clock() -> None:
    clock = SimulatedClock()
    seen: list[int] = []
    clock.on_jump(lambda _: clock.advance(START) if not seen.append(clock.now()) else None)  # type: ignore[func-returns-value]
    clock.advance(1)
    assert seen == [1]
    assert clock.now() == START


def test_a_branch_may_have_a_time_of_its_own() -> None:
    """It is closed with the clock that it is a branch of, all the same."""
    clock = Clock()
    branch = clock.branch(apart=True)
    beds = branch._source.sleepers = Beds()
    branch.enable_simulation()
    branch.advance(START)
    assert branch.simulated
    assert not clock.simulated
    task = Task(lambda: branch.branch().sleep(SECOND))
    assert beds.taken.acquire(timeout=TIMEOUT)
    clock.close()
    assert task.result() is False


@pytest.mark.parametrize("start", [0, START])
def test_sleeps_end_by_wall_time_when_the_simulation_ends(start: int) -> None:
    clock = SimulatedClock(start)
    until = time.time_ns() + 30_000_000
    tasks = [
        clock.asleep(lambda: clock.sleep(20_000_000)),
        clock.asleep(lambda: clock.sleep_until(until)),
        clock.asleep(clock.wait_started) if not start else Task(lambda: True),
    ]
    clock.disable_simulation()
    assert all(task.result() is True for task in tasks)
    assert time.time_ns() >= until
    assert abs(clock.now() - time.time_ns()) < TIMEOUT * SECOND


def test_what_a_simulated_sleep_has_done_is_not_done_again() -> None:
    clock = SimulatedClock()
    task = clock.asleep(lambda: clock.sleep(1000 * SECOND))
    clock.advance(START + 1000 * SECOND - 1)
    clock.disable_simulation()
    assert task.result() is True


def test_a_simulation_that_begins_anew_has_no_time_yet() -> None:
    clock = SimulatedClock()
    clock.disable_simulation()
    clock.disable_simulation()
    clock.enable_simulation()
    assert clock.now() == 0


def test_observers_of_switches() -> None:
    clock = Clock()
    told: list[object] = []

    def before() -> None:
        told.append(clock.simulated)

    clock.on_jump(told.append, wanted=lambda jump: jump.switched, before=before)
    clock.enable_simulation()
    clock.enable_simulation()
    clock.advance(START)
    clock.advance(1)
    clock.disable_simulation()
    first, on, second, off = told
    assert (first, second) == (False, True)
    assert isinstance(on, TimeJump)
    assert isinstance(off, TimeJump)
    assert (on.after, off.before, on.switched, off.switched) == (0, 1, True, True)
    assert abs(off.after - time.time_ns()) < TIMEOUT * SECOND
