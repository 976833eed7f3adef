"""Processes that cannot be ended, and reports that arrive too late."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator

import pytest

from rosz.errors import RoszError
from rosz.launch.run.console import Console
from rosz.launch.run.excerpt import Excerpt, Position
from rosz.launch.run.host import OnRead, OnReport
from rosz.launch.run.loop import Loop
from rosz.launch.run.process_tree import Usage
from rosz.launch.run.protocol import (
    Exited,
    Gone,
    ProcessRequest,
    Refused,
    Signal,
    Started,
    Timeouts,
)
from rosz.launch.run.supervisor import LaunchProcess, ProcessState, Supervisor

from .in_thread import program


class Machine:
    """A machine whose processes do not end, as in a blocked driver or when it is lost."""

    place = "far"

    def __init__(self, *, pending: bool) -> None:
        self.report: OnReport = lambda _: None
        self._pending = pending
        self.serials: list[int] = []
        self.signals: list[tuple[int, int]] = []

    def send(self, request: ProcessRequest) -> None:
        if isinstance(request, Signal):
            self.signals.append((request.serial, request.number))
            return
        self.serials.append(request.serial)
        if not self._pending:
            self.report(Started(request.serial, len(self.serials), "", ""))

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

    def started(self, process: LaunchProcess) -> None:
        del process
        self.said.append("started")

    def failed_to_start(self, process: LaunchProcess, error: RoszError) -> None:
        del process, error
        self.said.append("failed")

    def died(self, process: LaunchProcess) -> None:
        del process
        self.said.append("died")

    def finished(self, process: LaunchProcess) -> None:
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
    while len(machine.serials) == 1:
        loop.step(5.0)
    before = [*record.said]
    first, second = machine.serials
    for report in (Refused(first, "refused"), Exited(first, -9, ()), Gone(first)):
        machine.report(report)
    assert process.state is ProcessState.RUNNING
    assert process.alive
    assert record.said == before
    assert second not in dict(machine.signals)
