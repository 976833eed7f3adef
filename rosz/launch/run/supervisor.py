"""The processes of one launch: started in order, watched, restarted, ended together.

A `LaunchProcess` is one node from its waits to its end. The `Supervisor` owns all of them, reports
what happens in roslaunch's words, and ends the launch when a required process has ended, or when
all have ended and none is started again.
"""

from __future__ import annotations

import itertools
import signal
from collections.abc import Callable, Sequence
from enum import Enum
from functools import partial

from rosz.errors import LaunchError, NotFoundError, RoszError, near_miss
from rosz.launch.plan import Condition, NodePlan, StepPlan, Trigger, Wait
from rosz.launch.run.console import Console
from rosz.launch.run.host import Host
from rosz.launch.run.loop import Loop, LoopTimer
from rosz.launch.run.protocol import (
    Exited,
    ProcessReport,
    ProcessSpec,
    Refused,
    Signal,
    Start,
    Started,
    Timeouts,
)

_MIN_RESPAWN = 0.1
"""Least time in seconds from an end to the next start, so that a broken node does not use a CPU."""
_CONDITION_INTERVAL = 0.05
_AFTER_SIGKILL = 1.0
"""Time in seconds after which a process that SIGKILL did not end is given up."""
_RULE = "=" * 80


class ProcessState(Enum):
    """The state of a process."""

    WAITING = "waiting"
    RUNNING = "running"
    STOPPING = "stopping"
    RESPAWNING = "respawning"
    ENDED = "ended"
    FAILED = "failed"


class LaunchProcess:
    """One node, and the processes that run it one after the other.

    Attributes:
        child: The latest process, once its machine has started it.
        lost: Whether the latest process is lost with its machine, so that nobody knows its end.
        began: Time of the latest start, by the loop's clock.
        ended: Time of the latest end, by the loop's clock.
        killed: Whether it did not end in time and was killed.
        alive: Whether the latest process itself still runs.
        waits: Whether the event that it waits for has not come yet.
    """

    def __init__(self, node: NodePlan, number: int, host: Host, supervisor: Supervisor) -> None:
        self.node = node
        self.owner = number
        self.label = f"{node.full_name.strip('/')}-{number}"
        self.host = host
        self.state = ProcessState.WAITING
        self.child: Started | None = None
        self.code: int | None = None
        self.lost = False
        self.tail: tuple[str, ...] = ()
        self.error = ""
        self.starts = 0
        self.began = 0.0
        self.ended = 0.0
        self.killed = False
        self.alive = False
        self.waits = node.after is not None
        self._supervisor = supervisor
        self._loop = supervisor.loop
        self._timers: list[LoopTimer] = []
        self._again = False
        self._serial = 0
        host.report = supervisor.handle

    @property
    def over(self) -> bool:
        """Whether nothing of it runs, and nothing will unless requested."""
        return self.waits or self.state in {ProcessState.ENDED, ProcessState.FAILED}

    def begin(self) -> None:
        """Wait for the conditions of the node, then start it."""
        self.waits = False
        self.state = ProcessState.WAITING
        self._wait(self.node.wait_for)

    def _wait(self, waits: tuple[Wait, ...]) -> None:
        if not waits:
            self._after(self.node.spawn_delay, self._start)
            return
        wait, *later = waits
        deadline = self._loop.now() + wait.timeout

        def check() -> None:
            if any(map(self._supervisor.holds, wait.any_of)):
                self._wait(tuple(later))
            elif self._loop.now() >= deadline:
                self._fail(LaunchError(f"{wait.place}: no {wanted} within {wait.timeout:g} s"))
            else:
                self._after(_CONDITION_INTERVAL, check)

        wanted = " or ".join(map(str, wait.any_of))
        self._supervisor.console.say(
            f"[{self.label}] waiting for {wanted} (at most {wait.timeout:g} s)"
        )
        check()

    def _after(self, seconds: float, action: Callable[[], None]) -> None:
        if seconds > 0:
            self._timers.append(self._loop.later(seconds, action))
        else:
            action()

    def _start(self) -> None:
        self._cancel_timers()
        spec = ProcessSpec(self.node, self.owner, self.label, again=self.starts > 0)
        self.child = None
        self.state = ProcessState.RUNNING
        self.alive = True
        self._again = False
        self.code = None
        self.lost = False
        self.tail = ()
        self.starts += 1
        self.began = self._loop.now()
        self._serial = self._supervisor.register(self)
        self.host.send(Start(self._serial, spec))

    def handle(self, report: ProcessReport) -> None:
        """Handle a report about the latest process."""
        if isinstance(report, Started):
            self.child = report
            self._supervisor.started(self)
        elif isinstance(report, Refused):
            self.alive = False
            self._fail(LaunchError(report.text))
        elif not isinstance(report, Exited):
            self._gone()
        elif self.alive:
            self._exited(report)

    def _fail(self, error: RoszError) -> None:
        self._cancel_timers()
        self._supervisor.forget(self._serial)
        self.state = ProcessState.FAILED
        self.error = str(error)
        self._supervisor.failed_to_start(self, error)
        self._supervisor.finished(self)

    def _exited(self, report: Exited) -> None:
        requested = self.state is ProcessState.STOPPING
        self.code = report.code
        self.lost = report.code is None
        self.tail = report.tail
        self.ended = self._loop.now()
        self.alive = False
        self.state = ProcessState.STOPPING
        if not requested:
            limit = self.node.respawn_max
            self._again = self.node.respawn and (limit is None or self.starts <= limit)
            self._supervisor.died(self)
            sigterm = self._supervisor.timeouts.sigterm
            self._escalate((signal.SIGTERM, 0.0), (signal.SIGKILL, sigterm))

    def stop(self) -> None:
        """End it with SIGINT, then with stronger signals if that does not help."""
        self._again = False
        if self.state is ProcessState.RUNNING:
            self.state = ProcessState.STOPPING
            limits = self._supervisor.timeouts
            self._escalate(
                (signal.SIGINT, 0.0),
                (signal.SIGTERM, limits.sigint),
                (signal.SIGKILL, limits.sigint + limits.sigterm),
            )
        elif self.state in {ProcessState.WAITING, ProcessState.RESPAWNING}:
            self._finish()

    def kill(self) -> None:
        """End it with SIGKILL."""
        self.stop()
        if not self.over:
            self._cancel_timers()
            self._escalate((signal.SIGKILL, 0.0))

    def restart(self) -> None:
        """End it if it runs, and start it again, even if the plan does not respawn it."""
        if self.over or self.state in {ProcessState.WAITING, ProcessState.RESPAWNING}:
            self._start()
        else:
            self.stop()
            self._again = True

    def _escalate(self, *steps: tuple[signal.Signals, float]) -> None:
        for number, seconds in steps:
            self._after(seconds, partial(self._send, number, first=not seconds))
        if steps[-1][0] is signal.SIGKILL:
            last = steps[-1][1] + _AFTER_SIGKILL
            self._timers.append(self._loop.later(last, self._give_up))

    def _send(self, number: signal.Signals, *, first: bool) -> None:
        if not first:
            self.killed = number is signal.SIGKILL
            self._supervisor.escalating(self, number)
        self.host.send(Signal(self._serial, number))

    def _give_up(self) -> None:
        """Stop waiting for a process that SIGKILL does not end, such as one stuck in a driver."""
        if self.alive:  # its exit was not reported
            self.ended = self._loop.now()
        self._gone()

    def _gone(self) -> None:
        self._cancel_timers()
        self._supervisor.forget(self._serial)
        if not self._again:
            self._finish()
            return
        self.state = ProcessState.RESPAWNING
        due = self.ended + max(self.node.respawn_delay, _MIN_RESPAWN)

        def respawn() -> None:
            self._supervisor.console.say(f"[{self.label}] restarting process")
            self._start()

        self._after(due - self._loop.now(), respawn)

    def _finish(self) -> None:
        self._cancel_timers()
        self.state = ProcessState.ENDED
        self._supervisor.finished(self)

    def _cancel_timers(self) -> None:
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()

    def describe_end(self) -> str:
        """Return how it ended, in words."""
        if self.state is ProcessState.FAILED:
            return f"could not be started: {self.error}"
        text = describe_exit(self.code, lost=self.lost)
        if self.killed:
            text = "did not end when asked to, and was killed"
        respawns = self.starts - 1
        again = f", restarted {respawns} time{'s' * (respawns != 1)}" if respawns else ""
        return f"{text} after {self.ended - self.began:.1f} s{again}"


def describe_exit(code: int | None, *, lost: bool = False) -> str:
    """Return the meaning of an exit code in words, also of that of a process that is lost."""
    if lost:
        return "is lost with its machine"
    if code is None:
        return "gave no exit code"
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        return f"was ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"was ended by signal {-code}"


class Supervisor:
    """The processes of a launch.

    Args:
        host_of: Function that returns the machine of a node; it may raise `LaunchError`.
        loop: Loop that waits; it is stopped when the launch is over.
        holds: Function that returns whether a condition of ``wait_for`` is true.
        steps: What else the launch does.
        stay: Whether the launch continues when nothing runs any more.

    Attributes:
        processes: All processes, in order.
        failures: Processes that failed or died, in that order.
        failed: Whether a node could not be started, or a required one failed.
        closing: Whether the end of the launch has begun.
    """

    def __init__(
        self,
        nodes: Sequence[NodePlan],
        host_of: Callable[[NodePlan], Host],
        loop: Loop,
        console: Console,
        *,
        timeouts: Timeouts,
        holds: Callable[[Condition], bool],
        steps: Sequence[StepPlan] = (),
        stay: bool = False,
    ) -> None:
        self.loop = loop
        self._steps = steps
        self._waiting: list[tuple[Trigger, Callable[[], object]]] = []
        self.timeouts = timeouts
        self.holds = holds
        self._stay = stay
        self.console = console
        self.closing = False
        self._begun = False
        self._callbacks: dict[int, list[Callable[[], None]]] = {}
        self._host_of = host_of
        self._serials = itertools.count(1)
        self._running: dict[int, LaunchProcess] = {}
        self._deaths: list[Callable[[LaunchProcess], None]] = []
        self.failed = False
        self.failures: list[LaunchProcess] = []
        self.processes = [
            LaunchProcess(node, number, host_of(node), self) for number, node in enumerate(nodes, 1)
        ]

    @property
    def hosts(self) -> list[Host]:
        """All machines that the processes run on, each once."""
        return list({id(process.host): process.host for process in self.processes}.values())

    def start(self) -> None:
        """Start all processes, each as soon as its conditions are true."""
        actions: list[tuple[Trigger | None, Callable[[], object]]] = [
            *((step.after, partial(self._take, step, step.delay)) for step in self._steps),
            *((process.node.after, process.begin) for process in self.processes),
        ]
        self._waiting = [(after, action) for after, action in actions if after is not None]
        for after, action in actions:
            if after is None and not self.closing:
                action()
        self._begun = True
        self._end_when_over()

    def _happened(self, *events: Trigger) -> None:
        happened = [each for each in self._waiting if each[0] in events]
        self._waiting = [each for each in self._waiting if each not in happened]
        for _, action in happened:
            action()

    def _take(self, step: StepPlan, delay: float = 0.0) -> None:
        if delay > 0:
            self.loop.later(delay, partial(self._take, step))
        elif not self.closing:
            self.console.say(step.text or f"{step.place}: shutdown")
            if step.shutdown:
                self.shutdown()

    def add(self, node: NodePlan) -> LaunchProcess:
        """Start a further process, and return it; only on the loop's thread."""
        number = len(self.processes) + 1
        process = LaunchProcess(node, number, self._host_of(node), self)
        self.processes.append(process)
        process.begin()
        return process

    def on_death(self, callback: Callable[[LaunchProcess], None]) -> None:
        """Call a function with each process that ends by itself, on the loop's thread."""
        self._deaths.append(callback)

    def find(self, name: str) -> LaunchProcess:
        """Return the process of a node.

        Raises:
            NotFoundError: If this launch has no such node.
        """
        by_name = {process.node.full_name: process for process in self.processes}
        named = by_name.get(f"/{name.strip('/')}")
        if named is None:
            listing = f"; it has {', '.join(by_name)}" if by_name else ""
            raise NotFoundError(
                f"this launch has no node '{name}'{near_miss(name, by_name) or listing}"
            )
        return named

    def stop(self, process: LaunchProcess, done: Callable[[], None]) -> None:
        """End one process for good, then call a function."""
        self.console.say(f"[{process.label}] kill requested")
        if process.over:
            done()
            return
        self._callbacks.setdefault(process.owner, []).append(done)
        process.stop()

    def restart(self, process: LaunchProcess, done: Callable[[], None]) -> None:
        """End one process if it runs, start it again, and call a function when it has started."""
        self.console.say(f"[{process.label}] restart requested")
        self._callbacks.setdefault(process.owner, []).append(done)
        process.restart()

    def shutdown(self) -> None:
        """End all processes, then stop the loop; a second call has no effect."""
        if self.closing:
            return
        self.closing = True
        for process in reversed(self.processes):
            if process.state is ProcessState.RUNNING:
                self.console.say(f"[{process.label}] killing on exit")
            process.stop()
        self._end_when_over()

    def kill(self) -> None:
        """End all processes with SIGKILL, then stop the loop."""
        self.closing = True
        for process in self.processes:
            process.kill()
        self._end_when_over()

    # Reports of machines and processes.

    def register(self, process: LaunchProcess) -> int:
        """Return the number of a process that is about to start, for requests and reports."""
        serial = next(self._serials)
        self._running[serial] = process
        return serial

    def forget(self, serial: int) -> None:
        """Ignore further reports about a process that has ended or is given up."""
        self._running.pop(serial, None)

    def handle(self, report: ProcessReport) -> None:
        """Handle a report of a machine."""
        process = self._running.get(report.serial)
        if process is not None:
            process.handle(report)

    def started(self, process: LaunchProcess) -> None:
        """Report that a process runs."""
        if process.child is not None:
            where = f" on {process.host.place}" if process.host.place else ""
            self.console.strong(
                f"process[{process.label}]: started with pid [{process.child.pid}]{where}"
            )
            self.console.note(f"process[{process.label}]: {process.child.shown}")
        self._happened(Trigger("start", process.node.full_name), Trigger("start", ""))
        self._call_back(process)

    def failed_to_start(self, process: LaunchProcess, error: RoszError) -> None:
        """Report that a process cannot be started."""
        node = process.node
        what = f"{node.package}/{node.type}" if node.package else node.full_name
        if node.members:
            what = " + ".join(f"{member.package}/{member.type}" for member in node.members)
        self.console.error(f"ERROR: cannot launch node of type [{what}]: {error}")
        self.failed = True
        self.failures.append(process)
        if node.required and not self.closing:
            self.console.error(f"REQUIRED process [{process.label}] cannot be started\n")
            self.shutdown()

    def died(self, process: LaunchProcess) -> None:
        """Report that a process ended by itself, and end the others if it was required."""
        for callback in self._deaths:
            callback(process)
        text = self._describe_death(process)
        if process not in self.failures and (process.code != 0 or process.node.required):
            self.failures.append(process)
        if process.node.required:
            self.console.error(
                f"{_RULE}REQUIRED process [{process.label}] has died!\n{text}\n"
                f"Initiating shutdown!\n{_RULE}"
            )
            self.failed = self.failed or process.code != 0
            self.shutdown()
        elif process.code != 0:
            self.console.error(f"[{process.label}] {text}")
        else:
            self.console.strong(f"[{process.label}] {text}")
        if not self.closing:
            self._happened(Trigger("exit", process.node.full_name), Trigger("exit", ""))

    @staticmethod
    def _describe_death(process: LaunchProcess) -> str:
        child = process.child
        nodes = ", ".join(member.full_name for member in process.node.members)
        what = f"process of nodes {nodes}" if nodes else "process"
        text = f"{what} has finished cleanly"
        if process.lost and child is not None:
            text = (
                f"{what} is lost with its machine [pid {child.pid} on {process.host.place}, exit"
                f" code unknown, cmd {child.shown}]."
            )
        elif process.code and child is not None:
            text = (
                f"{what} has died [pid {child.pid}, exit code {process.code}, cmd {child.shown}]."
            )
        if child is None or not child.logs:
            return text
        where = f"{process.host.place}:" if process.host.place else ""
        return f"{text}\nlog file: {where}{child.logs}"

    def escalating(self, process: LaunchProcess, number: int) -> None:
        """Report that a process did not end in time and gets a stronger signal."""
        self.console.error(f"[{process.label}] escalating to {signal.Signals(number).name}")
        if process.killed and process not in self.failures:
            self.failures.append(process)

    def finished(self, process: LaunchProcess) -> None:
        """Handle the final end of a process and its descendants."""
        self._call_back(process)
        self._end_when_over()

    def _call_back(self, process: LaunchProcess) -> None:
        for done in self._callbacks.pop(process.owner, []):
            done()

    def _end_when_over(self) -> None:
        if not all(process.over for process in self.processes):
            return
        if not self.closing:
            if self._stay or not self._begun:
                return
            self.console.say("all processes on machine have died, rosz launch will exit")
        self.closing = True
        self.loop.stop()
