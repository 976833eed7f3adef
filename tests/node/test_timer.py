from __future__ import annotations

import itertools
import queue
import threading
from collections.abc import Iterator

import pytest
from network import TIMEOUT
from simulation import SECOND, START, SimulatedClock

from rosz.errors import ClosedError, TimeMovedBackwards, UsageError
from rosz.node.clock import Clock
from rosz.node.timer import Timer, TimerEvent


class Bench:
    """A simulated clock, and the calls of timers on it."""

    def __init__(self, start: int = START) -> None:
        self.clock = SimulatedClock(start)
        self.events: queue.Queue[TimerEvent] = queue.Queue()
        self.errors: queue.Queue[tuple[str, BaseException]] = queue.Queue()
        self.ended: queue.Queue[Timer] = queue.Queue()

    def timer(self, *, oneshot: bool = False, reset: bool = False) -> Timer:
        return Timer(
            SECOND,
            self.events.put,
            self.clock,
            on_error=self.report,
            oneshot=oneshot,
            reset=reset,
            name="beat",
            on_end=self.ended.put,
        )

    def report(self, text: str, error: BaseException) -> None:
        self.errors.put((text, error))

    def tick(self, time_ns: int) -> TimerEvent:
        """Advance the clock for a sleeping timer, and return the event of its call."""
        self.clock.tick(time_ns)
        return self.events.get(timeout=TIMEOUT)


@pytest.fixture
def bench() -> Iterator[Bench]:
    bench = Bench()
    yield bench
    bench.clock.close()


def test_timer_calls_at_each_period(bench: Bench) -> None:
    bench.timer()
    first = bench.tick(START + SECOND)
    assert first == TimerEvent(None, None, START + SECOND, START + SECOND, None)
    second = bench.tick(START + 2 * SECOND + 7)
    assert second.last_expected == second.last_real == START + SECOND
    assert second.current_expected == START + 2 * SECOND
    assert second.current_real == START + 2 * SECOND + 7
    assert second.last_duration is not None
    assert 0 <= second.last_duration < TIMEOUT * SECOND
    third = bench.tick(START + 3 * SECOND)
    assert third.last_real == START + 2 * SECOND + 7
    assert third.current_expected == START + 3 * SECOND


def test_late_timer_makes_up_then_gives_up_what_it_missed(bench: Bench) -> None:
    bench.timer()
    bench.tick(START + 2 * SECOND)
    assert bench.events.get(timeout=TIMEOUT).current_expected == START + 2 * SECOND
    # Far too late: one call at once, one more from the period that the leap fell into, then none.
    assert bench.tick(START + 60 * SECOND).current_real == START + 60 * SECOND
    assert bench.events.get(timeout=TIMEOUT).current_real == START + 60 * SECOND
    bench.clock.wait_for_sleeper()
    assert bench.events.empty()


def test_timer_starts_with_the_first_tick() -> None:
    bench = Bench(0)
    bench.timer()
    bench.clock.tick(START)
    assert bench.tick(START + SECOND).current_expected == START + SECOND
    assert bench.tick(START + 2 * SECOND).current_expected == START + 2 * SECOND
    bench.clock.close()


def test_oneshot_calls_once(bench: Bench) -> None:
    timer = bench.timer(oneshot=True)
    assert timer.alive
    bench.tick(START + SECOND)
    assert bench.ended.get(timeout=TIMEOUT) is timer
    assert timer.join(TIMEOUT)
    assert not timer.alive
    assert bench.events.empty()


def test_closing_ends_a_sleeping_timer_at_once(bench: Bench) -> None:
    with bench.timer() as timer:
        bench.clock.wait_for_sleeper()
    assert timer.join(TIMEOUT)
    timer.close()
    timer.shutdown()
    assert bench.ended.get(timeout=TIMEOUT) is timer
    assert not bench.clock.closed
    assert bench.events.empty()


def test_timer_ends_with_its_clock(bench: Bench) -> None:
    timer = bench.timer()
    bench.clock.wait_for_sleeper()
    bench.clock.close()
    assert timer.join(TIMEOUT)


def test_timer_may_be_closed_and_joined_in_its_own_callback(bench: Bench) -> None:
    answers: queue.Queue[bool] = queue.Queue()
    timers: queue.Queue[Timer] = queue.Queue()

    def stop(_: TimerEvent) -> None:
        timer = timers.get(timeout=TIMEOUT)
        timer.close()
        answers.put(timer.join())

    timer = Timer(SECOND, stop, bench.clock, on_error=bench.report)
    timers.put(timer)
    bench.clock.tick(START + SECOND)
    assert answers.get(timeout=TIMEOUT) is False
    assert timer.join(TIMEOUT)
    assert bench.errors.empty()


@pytest.mark.parametrize("kind", [ValueError, SystemExit, KeyboardInterrupt])
def test_error_in_the_callback_is_reported_and_the_timer_goes_on(
    bench: Bench, kind: type[BaseException]
) -> None:
    def fail(_: TimerEvent) -> None:
        raise kind("no")

    Timer(SECOND, fail, bench.clock, on_error=bench.report, name="beat")
    for count in (1, 2):
        bench.clock.tick(START + count * SECOND)
        text, error = bench.errors.get(timeout=TIMEOUT)
        assert text == "callback of timer 'beat' failed"
        assert isinstance(error, kind)
        assert error.__traceback__ is not None


def test_use_of_closed_things_in_a_callback_during_shutdown_is_no_error(bench: Bench) -> None:
    def fail(_: TimerEvent) -> None:
        bench.clock.close()
        raise ClosedError("the publisher is closed")

    timer = Timer(SECOND, fail, bench.clock, on_error=bench.report)
    bench.clock.tick(START + SECOND)
    assert timer.join(TIMEOUT)
    assert bench.errors.empty()


def test_use_of_closed_things_in_a_callback_is_an_error_otherwise(bench: Bench) -> None:
    def fail(_: TimerEvent) -> None:
        raise ClosedError("the publisher is closed")

    Timer(SECOND, fail, bench.clock, on_error=bench.report)
    bench.clock.tick(START + SECOND)
    assert isinstance(bench.errors.get(timeout=TIMEOUT)[1], ClosedError)


def test_timer_stops_with_an_error_when_time_moves_back(bench: Bench) -> None:
    timer = bench.timer()
    bench.clock.tick(1)
    text, error = bench.errors.get(timeout=TIMEOUT)
    assert text == "timer 'beat' stopped"
    assert isinstance(error, TimeMovedBackwards)
    assert timer.join(TIMEOUT)


def test_timer_with_reset_goes_on_when_time_moves_back(bench: Bench) -> None:
    bench.timer(reset=True)
    bench.tick(START + SECOND)
    again = bench.tick(50 * SECOND)
    assert again.current_expected == again.current_real == 50 * SECOND
    assert bench.tick(51 * SECOND).current_expected == 51 * SECOND
    assert bench.errors.empty()


@pytest.mark.parametrize("period", [0, -1])
def test_period_that_means_nothing(bench: Bench, period: int) -> None:
    with pytest.raises(UsageError, match=f"timer period is '{period}' ns: expected above 0"):
        Timer(period, bench.events.put, bench.clock, on_error=bench.report)


def test_timer_is_named_after_its_callback(bench: Bench) -> None:
    def beat(_: TimerEvent) -> None:
        """Do nothing."""

    with Timer(SECOND, beat, bench.clock, on_error=bench.report) as timer:
        assert timer.name.endswith("beat")
        assert repr(timer) == f"<Timer {timer.name} every 1 s>"
        assert any(timer.name in thread.name for thread in threading.enumerate())
    assert timer.join(TIMEOUT)
    assert repr(timer).endswith("ended>")


def test_timer_in_wall_time() -> None:
    clock = Clock()
    events: queue.Queue[TimerEvent] = queue.Queue()
    start = clock.now()
    timer = Timer(5_000_000, events.put, clock, on_error=lambda *_: None)
    got = [events.get(timeout=TIMEOUT) for _ in range(4)]
    clock.close()
    assert timer.join(TIMEOUT)
    steps = [
        after.current_expected - before.current_expected
        for before, after in itertools.pairwise(got)
    ]
    assert steps == [5_000_000] * 3
    assert got[3].current_real - start >= 4 * 5_000_000 - 1
