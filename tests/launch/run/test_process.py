"""A process and those that come after each other in it, on a machine that answers as it likes."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import pytest

from rosz.errors import LaunchError, RoszError
from rosz.launch.plan.model import Wait
from rosz.launch.run.family import Usage
from rosz.launch.run.host import Confirmed, Ended, Job
from rosz.launch.run.loop import Loop
from rosz.launch.run.process import Process, State, Timeouts
from rosz.launch.run.summary import reason

from .scene import program


class Stuck:
    """A child that nothing ends, as in a driver that hangs or behind a link that is cut."""

    shown = logs = place = ""

    def __init__(self, pid: int, *, pending: bool) -> None:
        self.pid = pid
        self.pending = pending
        self.signals: list[int] = []

    def signal(self, number: int) -> None:
        self.signals.append(number)

    def remains(self) -> bool:
        return True


class Machine:
    """Starts such children, and keeps what they are to be told."""

    place = "far"

    def __init__(self, *, pending: bool) -> None:
        self._pending = pending
        self.children: list[Stuck] = []
        self.told: list[tuple[Ended, Confirmed]] = []

    def start(self, job: Job, ended: Ended, confirmed: Confirmed) -> Stuck:
        del job
        self.children.append(Stuck(len(self.children) + 1, pending=self._pending))
        self.told.append((ended, confirmed))
        return self.children[-1]

    def measure(self, done: Callable[[dict[int, Usage]], None]) -> None:
        done({})


class Record:
    """What a process tells."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def waiting(self, process: Process, wait: Wait) -> None:
        del process, wait

    def started(self, process: Process) -> None:
        del process
        self.said.append("started")

    def failed_to_start(self, process: Process, error: RoszError) -> None:
        del process, error
        self.said.append("failed")

    def died(self, process: Process) -> None:
        del process
        self.said.append("died")

    def respawning(self, process: Process) -> None:
        del process

    def escalating(self, process: Process, number: int) -> None:
        del process, number

    def settled(self, process: Process) -> None:
        del process
        self.said.append("settled")


@pytest.fixture
def loop() -> Iterator[Loop]:
    made = Loop()
    yield made
    made.close()


def test_what_nothing_ends_ended_when_it_was_given_up(loop: Loop) -> None:
    machine, record = Machine(pending=False), Record()
    process = Process(
        program("n", "x"), "n-1", 1, machine, loop, record, timeouts=Timeouts(0.01, 0.01)
    )
    process.begin()
    process.stop()
    while not process.over:
        loop.step(5.0)
    assert process.ended > process.began
    assert re.fullmatch(
        r"did not end when asked to, and was killed after [1-9][0-9.]* s", reason(process)
    )


@pytest.mark.parametrize("pending", [False, True], ids=["here", "there"])
def test_what_was_given_up_says_nothing_of_what_came_after_it(loop: Loop, pending: bool) -> None:
    machine, record = Machine(pending=pending), Record()
    process = Process(
        program("n", "x"), "n-1", 1, machine, loop, record, timeouts=Timeouts(0.01, 0.01)
    )
    process.begin()
    process.restart()
    while len(machine.children) == 1:
        loop.step(5.0)
    before = [*record.said]
    ended, confirmed = machine.told[0]
    confirmed(LaunchError("refused"))
    ended(-9, ())
    assert process.state is State.RUNNING
    assert process.alive
    assert record.said == before
    assert machine.children[1].signals == []
