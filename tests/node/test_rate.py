from __future__ import annotations

import math
import random
from itertools import islice
from pathlib import Path

import pytest
from oracle import real
from simulation import SECOND, START, SimulatedClock, Task

from rosz.errors import ClosedError, TimeMovedBackwards, UsageError
from rosz.node.clock import Clock
from rosz.node.timer import Rate

# Each turn of each loop: do some work, ask what remains, sleep; time moves back in some sleeps.
_ROSPY_LOOPS = """
import rospy.timer
from rospy.exceptions import ROSTimeMovedBackwardsException

def set_time(ns):
    rospy.rostime._set_rostime(rospy.Time(0, ns))

def run(loop):
    set_time(loop['start'])
    rate = rospy.Rate(loop['hz'], reset=loop['reset'])
    seen = []
    for work, extra in loop['turns']:
        set_time(max(rospy.Time.now().to_nsec() + work, 1))
        seen.append(rate.remaining().to_nsec())

        def sleep(duration):
            seen.append(duration.to_nsec())
            end = rospy.Time.now().to_nsec() + max(duration.to_nsec(), 0) + extra
            if extra < 0:
                set_time(max(end, 1))
                raise ROSTimeMovedBackwardsException(1.0)
            set_time(end)

        rospy.timer.sleep = sleep
        try:
            rate.sleep()
        except ROSTimeMovedBackwardsException:
            seen.append('moved back')
        seen.append(rospy.Time.now().to_nsec())
    return seen

rospy.rostime.set_rostime_initialized(True)
result = [run(loop) for loop in given]
"""


class ScriptedClock(Clock):
    """A clock whose sleeps end when the script says."""

    def __init__(self, start: int) -> None:
        super().__init__()
        self.time = start
        self.extra = 0
        self.seen: list[int | str] = []

    def steady(self) -> int:
        return self.time

    def sleep(self, duration_ns: int) -> bool:
        self.seen.append(duration_ns)
        before, self.time = self.time, self.time + max(duration_ns, 0) + self.extra
        if self.extra < 0:
            self.time = max(self.time, 1)
            raise TimeMovedBackwards(before, self.time)
        return True


def _loops(count: int) -> list[dict[str, object]]:
    chance = random.Random(4)
    loops: list[dict[str, object]] = []
    for _ in range(count):
        hz = chance.choice([0.3, 1, 3, 7.5, 10, 100, 997])
        period = int(1e9 / hz)
        works = [
            0,
            period // 3,
            period,
            2 * period,
            3 * period,
            3 * period + 1,
            50 * period,
            -period,
        ]
        turns = [
            (
                chance.choice(works) + chance.randrange(3),
                chance.choice([0, 0, 0, 5, period, -period]),
            )
            for _ in range(12)
        ]
        start = chance.choice([1, SECOND, START, 17 * 10**17])
        loops.append({"hz": hz, "reset": chance.random() < 0.5, "start": start, "turns": turns})
    return loops


def _run(loop: dict[str, object]) -> list[int | str]:
    clock = ScriptedClock(loop["start"])  # type: ignore[arg-type]
    rate = Rate(loop["hz"], clock, reset=loop["reset"])  # type: ignore[arg-type]
    for work, extra in loop["turns"]:  # type: ignore[attr-defined]
        clock.time = max(clock.time + work, 1)
        clock.seen.append(rate.remaining())
        clock.extra = extra
        try:
            rate.sleep()
        except TimeMovedBackwards:
            clock.seen.append("moved back")
        clock.seen.append(clock.time)
    return clock.seen


@pytest.mark.ros1
def test_rate_sleeps_exactly_as_rospys_does(tmp_path: Path) -> None:
    loops = _loops(400)
    expected = real(_ROSPY_LOOPS, "rospy", "python3-rospy", given=loops, home=str(tmp_path))
    assert sum(turn == "moved back" for seen in expected for turn in seen) > 100
    for loop, seen in zip(loops, expected, strict=True):
        assert _run(loop) == seen, loop


@pytest.mark.parametrize("hz", [0, -1, math.nan, math.inf, -math.inf, 2e9])
def test_rate_that_means_nothing(hz: float) -> None:
    with pytest.raises(UsageError, match=rf"rate is '{hz}' Hz: expected above 0"):
        Rate(hz, Clock())


def test_period_and_what_remains_of_it() -> None:
    clock = SimulatedClock()
    rate = Rate(4, clock)
    assert rate.period_ns == rate.remaining() == SECOND // 4
    clock.advance(START + SECOND)
    assert rate.remaining() == SECOND // 4 - SECOND
    rate.restart()
    assert rate.remaining() == SECOND // 4


def test_sleep_in_simulated_time() -> None:
    clock = SimulatedClock()
    rate = Rate(1, clock)
    task = clock.asleep(rate.sleep)
    clock.advance(START + SECOND)
    task.result()
    assert rate.remaining() == SECOND


def test_sleep_of_a_closed_clock_raises() -> None:
    clock = SimulatedClock()
    rate = Rate(1, clock)
    task = clock.asleep(rate.sleep)
    clock.close()
    with pytest.raises(ClosedError, match="shut down"):
        task.result()
    with pytest.raises(ClosedError):
        rate.sleep()


def test_time_that_moves_back_in_a_sleep() -> None:
    clock = SimulatedClock()
    strict = clock.asleep(Rate(1, clock).sleep)
    lenient_rate = Rate(1, clock, reset=True)
    lenient = clock.asleep(lenient_rate.sleep)
    clock.advance(START - 60 * SECOND)
    with pytest.raises(TimeMovedBackwards):
        strict.result()
    lenient.result()
    assert lenient_rate.remaining() == SECOND


def test_iteration_counts_from_zero_at_once() -> None:
    assert next(iter(Rate(0.001, Clock()))) == 0


def test_iteration_sleeps_between_turns() -> None:
    clock = SimulatedClock()
    rate = Rate(1, clock)
    clock.advance(START + 10 * SECOND)
    task = Task(lambda: [(tick, clock.now()) for tick in islice(rate, 3)])
    for count in (1, 2):
        clock.tick(START + 10 * SECOND + count * SECOND)
    assert task.result() == [(count, START + (10 + count) * SECOND) for count in range(3)]


def test_iteration_ends_when_the_clock_closes() -> None:
    clock = SimulatedClock()
    task = clock.asleep(lambda: list(Rate(1, clock)))
    clock.close()
    assert task.result() == [0]
    assert list(Rate(1, clock)) == []


def test_iteration_goes_on_when_time_moves_back() -> None:
    clock = SimulatedClock()
    task = clock.asleep(lambda: [clock.now() for _ in islice(Rate(1, clock), 3)])
    clock.advance(SECOND)
    clock.tick(2 * SECOND)
    assert task.result() == [START, SECOND, 2 * SECOND]


def test_iteration_in_wall_time() -> None:
    clock = Clock()
    times = [clock.steady() for _ in islice(Rate(200, clock), 5)]
    assert times[4] - times[0] >= 4 * 5_000_000 - 1
