"""Processes that cannot be ended, and reports that arrive too late."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator

import pytest

from rosz.errors import LaunchError, RoszError
from rosz.launch.run.console import Console
from rosz.launch.run.excerpt import Excerpt, Position
from rosz.launch.run.host import OnExit, OnRead, OnStart, ProcessSpec
from rosz.launch.run.loop import Loop
from rosz.launch.run.process_tree import Usage
from rosz.launch.run.supervisor import Process, State, Supervisor, Timeouts

from .in_thread import program


class Stuck:
    """A child that does not end, as in a blocked driver or on a machine that is lost."""

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
    """A machine that starts such children, and keeps the callbacks."""

    place = "far"

    def __init__(self, *, pending: bool) -> None:
        self._pending = pending
        self.children: list[Stuck] = []
        self.callbacks: list[tuple[OnExit, OnStart]] = []

    def start(self, spec: ProcessSpec, on_exit: OnExit, on_start: OnStart) -> Stuck:
        del spec
        self.children.append(Stuck(len(self.children) + 1, pending=self._pending))
        self.callbacks.append((on_exit, on_start))
        return self.children[-1]

    def measure(self, done: Callable[[dict[int, Usage]], None]) -> None:
        done({})

    def read_output(self, owner: int, after: Position | None, done: OnRead) -> None:
        del owner, after
        done(Excerpt("", (0, 0)))


class Record(Supervisor):
    """A supervisor that records what one process reports."""

    def __init__(self, loop: Loop, machine: Machine) -> None:
        super().__init__(
            [program("n", "x")],
            lambda _: machine,
            loop,
            Console(io.StringIO(), io.StringIO()),
            timeouts=Timeouts(0.01, 0.01),
            holds=lambda _: True,
        )
        self.said: list[str] = []
        (self.process,) = self.processes

    def started(self, process: Process) -> None:
        del process
        self.said.append("started")

    def failed_to_start(self, process: Process, error: RoszError) -> None:
        del process, error
        self.said.append("failed")

    def died(self, process: Process) -> None:
        del process
        self.said.append("died")

    def finished(self, process: Process) -> None:
        del process
        self.said.append("finished")


@pytest.fixture
def loop() -> Iterator[Loop]:
    made = Loop()
    yield made
    made.close()


def test_a_process_that_does_not_end_is_given_up(loop: Loop) -> None:
    machine = Machine(pending=False)
    record = Record(loop, machine)
    process = record.process
    process.begin()
    process.stop()
    while not process.over:
        loop.step(5.0)
    assert process.ended > process.began
    assert re.fullmatch(
        r"did not end when asked to, and was killed after [1-9][0-9.]* s", process.describe_end()
    )


@pytest.mark.parametrize("pending", [False, True], ids=["here", "there"])
def test_late_reports_of_a_process_do_not_affect_its_successor(loop: Loop, pending: bool) -> None:
    machine = Machine(pending=pending)
    record = Record(loop, machine)
    process = record.process
    process.begin()
    process.restart()
    while len(machine.children) == 1:
        loop.step(5.0)
    before = [*record.said]
    on_exit, on_start = machine.callbacks[0]
    on_start(LaunchError("refused"))
    on_exit(-9, ())
    assert process.state is State.RUNNING
    assert process.alive
    assert record.said == before
    assert machine.children[1].signals == []
