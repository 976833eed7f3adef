"""The processes of one launch: started in order, watched, restarted, ended together.

A `Process` is one node from its waits to its end. The `Supervisor` owns all of them, reports what
happens in roslaunch's words, and ends the launch when a required process has ended, or when all
have ended and none is started again.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Sequence
from enum import Enum
from functools import partial

import msgspec

from rosz.errors import LaunchError, NotFoundError, RoszError, near_miss
from rosz.launch.plan import Condition, NodePlan, Wait
from rosz.launch.run.console import Console
from rosz.launch.run.host import Child, Host, ProcessSpec
from rosz.launch.run.loop import Loop, Timer

__all__ = ("Process", "State", "Supervisor", "Timeouts", "describe_exit")

_MIN_RESPAWN = 0.1
"""Least time in seconds from an end to the next start, so that a broken node does not use a CPU."""
_MIN_CHECK, _MAX_CHECK = 0.005, 0.1
_CONDITION_INTERVAL = 0.05
_AFTER_SIGKILL = 1.0
"""Time in seconds after which a process that SIGKILL did not end is given up."""
_RULE = "=" * 80


class Timeouts(msgspec.Struct, frozen=True):
    """The time that processes have to end.

    Attributes:
        sigint: Time from SIGINT to SIGTERM in seconds.
        sigterm: Time from SIGTERM to SIGKILL in seconds.
    """

    sigint: float = 15.0
    sigterm: float = 2.0


class State(Enum):
    """The state of a process."""

    WAITING = "waiting"
    RUNNING = "running"
    STOPPING = "stopping"
    RESPAWNING = "respawning"
    ENDED = "ended"
    FAILED = "failed"


class Process:
    """One node, and the processes that run it one after the other.

    Args:
        node: The node from the plan.
        number: Number of the node in the launch.
        host: The machine that it runs on.
        supervisor: The supervisor, which is notified of what happens.

    Attributes:
        label: Name that messages show.
        state: Current state.
        child: The latest process, or None.
        code: Exit code of the latest process, or None.
        lost: Whether the latest process is lost with its machine, so that nobody knows its end.
        tail: Last lines of its output.
        error: Reason why it could not be started, or "".
        starts: Number of starts.
        began: Time of the latest start, by the loop's clock.
        ended: Time of the latest end, by the loop's clock.
        killed: Whether it did not end in time and was killed.
        alive: Whether the latest process itself still runs.
    """

    def __init__(self, node: NodePlan, number: int, host: Host, supervisor: Supervisor) -> None:
        self.node = node
        self.owner = number
        self.label = f"{node.full_name.strip('/')}-{number}"
        self.host = host
        self.state = State.WAITING
        self.child: Child | None = None
        self.code: int | None = None
        self.lost = False
        self.tail: tuple[str, ...] = ()
        self.error = ""
        self.starts = 0
        self.began = 0.0
        self.ended = 0.0
        self.killed = False
        self.alive = False
        self._supervisor = supervisor
        self._loop = supervisor.loop
        self._timeouts = supervisor.timeouts
        self._timers: list[Timer] = []
        self._again = False

    @property
    def place(self) -> str:
        """Address of its machine, or "" for this one."""
        return self.host.place

    @property
    def over(self) -> bool:
        """Whether nothing of it runs, and nothing will unless requested."""
        return self.state in {State.ENDED, State.FAILED}

    def begin(self) -> None:
        """Wait for the conditions of the node, then start it."""
        self.state = State.WAITING
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
                wanted = " or ".join(map(str, wait.any_of))
                self._fail(LaunchError(f"{wait.place}: no {wanted} within {wait.timeout:g} s"))
            else:
                self._after(_CONDITION_INTERVAL, check)

        self._supervisor.waiting(self, wait)
        check()

    def _after(self, seconds: float, action: Callable[[], None]) -> None:
        if seconds > 0:
            self._timers.append(self._loop.later(seconds, action))
        else:
            action()

    def _start(self) -> None:
        self._cancel_timers()
        spec = ProcessSpec(self.node, self.owner, self.label, again=self.starts > 0)
        which = self.starts + 1
        try:
            self.child = self.host.start(
                spec, partial(self._exited, which), partial(self._confirmed, which)
            )
        except RoszError as error:
            self._fail(error)
            return
        self.state = State.RUNNING
        self.alive = True
        self._again = False
        self.code = None
        self.lost = False
        self.tail = ()
        self.starts = which
        self.began = self._loop.now()
        if not self.child.pending:
            self._supervisor.started(self)

    def _is_outdated(self, which: int) -> bool:
        """Return whether a report is about a process that has been given up or replaced."""
        return self.over or which != self.starts

    def _confirmed(self, which: int, error: RoszError | None) -> None:
        """Handle the answer of another machine to a start."""
        if self._is_outdated(which):
            return
        if error is None:
            self._supervisor.started(self)
            return
        self.alive = False
        self._fail(error)

    def _fail(self, error: RoszError) -> None:
        self._cancel_timers()
        self.state = State.FAILED
        self.error = str(error)
        self._supervisor.failed_to_start(self, error)
        self._supervisor.finished(self)

    def _exited(self, which: int, code: int | None, tail: tuple[str, ...]) -> None:
        if self._is_outdated(which):
            return
        requested = self.state is State.STOPPING
        self.code = code
        self.lost = code is None
        self.tail = tail
        self.ended = self._loop.now()
        self.alive = False
        self.state = State.STOPPING
        if not requested:
            limit = self.node.respawn_max
            self._again = self.node.respawn and (limit is None or self.starts <= limit)
            self._supervisor.died(self)
            self._escalate((signal.SIGTERM, 0.0), (signal.SIGKILL, self._timeouts.sigterm))
        self._check_gone(_MIN_CHECK)

    def stop(self) -> None:
        """End it with SIGINT, then with stronger signals if that does not help."""
        self._again = False
        if self.state is State.RUNNING:
            self.state = State.STOPPING
            self._escalate(
                (signal.SIGINT, 0.0),
                (signal.SIGTERM, self._timeouts.sigint),
                (signal.SIGKILL, self._timeouts.sigint + self._timeouts.sigterm),
            )
        elif self.state in {State.WAITING, State.RESPAWNING}:
            self._finish()

    def kill(self) -> None:
        """End it with SIGKILL."""
        self.stop()
        if self.child is not None and not self.over:
            self._cancel_timers()
            self._escalate((signal.SIGKILL, 0.0))
            if not self.alive:
                self._check_gone(_MIN_CHECK)

    def restart(self) -> None:
        """End it if it runs, and start it again, even if the plan does not respawn it."""
        if self.over or self.state in {State.WAITING, State.RESPAWNING}:
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
        if self.child is None or not self.child.remains():
            return
        if not first:
            self.killed = number is signal.SIGKILL
            self._supervisor.escalating(self, number)
        self.child.signal(number)

    def _check_gone(self, interval: float) -> None:
        """Continue once the process and all descendants have ended."""
        if self.child is None or not self.child.remains():
            self._gone()
        else:
            longer = min(2 * interval, _MAX_CHECK)
            self._timers.append(self._loop.later(interval, lambda: self._check_gone(longer)))

    def _give_up(self) -> None:
        """Stop waiting for a process that SIGKILL does not end, such as one stuck in a driver."""
        if self.alive:  # its exit was not reported
            self.ended = self._loop.now()
        self._gone()

    def _gone(self) -> None:
        self._cancel_timers()
        if not self._again:
            self._finish()
            return
        self.state = State.RESPAWNING
        due = self.ended + max(self.node.respawn_delay, _MIN_RESPAWN)

        def respawn() -> None:
            self._supervisor.respawning(self)
            self._start()

        self._after(due - self._loop.now(), respawn)

    def _finish(self) -> None:
        self._cancel_timers()
        self.state = State.ENDED
        self._supervisor.finished(self)

    def _cancel_timers(self) -> None:
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()

    def describe_end(self) -> str:
        """Return how it ended, in words."""
        if self.state is State.FAILED:
            return f"could not be started: {self.error}"
        text = describe_exit(self.code, lost=self.lost)
        if self.killed:
            text = "did not end when asked to, and was killed"
        respawns = self.starts - 1
        again = f", restarted {respawns} time{'s' * (respawns != 1)}" if respawns else ""
        return f"{text} after {self.ended - self.began:.1f} s{again}"


def describe_exit(code: int | None, *, lost: bool = False) -> str:
    """Return the meaning of an exit code in words.

    Args:
        code: The exit code, or None if there is none.
        lost: Whether the process is lost with its machine.
    """
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
        nodes: The nodes to run, in order.
        host_of: Function that returns the machine of a node; it may raise `LaunchError`.
        loop: Loop that waits; it is stopped when the launch is over.
        console: Output for reports.
        timeouts: Time that processes have to end.
        holds: Function that returns whether a condition of ``wait_for`` is true.
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
        stay: bool = False,
    ) -> None:
        self.loop = loop
        self.timeouts = timeouts
        self.holds = holds
        self._stay = stay
        self._console = console
        self.closing = False
        self._begun = False
        self._callbacks: dict[int, list[Callable[[], None]]] = {}
        self._host_of = host_of
        self._deaths: list[Callable[[Process], None]] = []
        self.failed = False
        self.failures: list[Process] = []
        self.processes = [
            Process(node, number, host_of(node), self) for number, node in enumerate(nodes, 1)
        ]

    @property
    def hosts(self) -> list[Host]:
        """All machines that the processes run on, each once."""
        return list({id(process.host): process.host for process in self.processes}.values())

    def start(self) -> None:
        """Start all processes, each as soon as its conditions are true."""
        for process in self.processes:
            if not self.closing:
                process.begin()
        self._begun = True
        self._end_when_over()

    def add(self, node: NodePlan) -> Process:
        """Start a further process, and return it; only on the loop's thread."""
        number = len(self.processes) + 1
        process = Process(node, number, self._host_of(node), self)
        self.processes.append(process)
        process.begin()
        return process

    def on_death(self, callback: Callable[[Process], None]) -> None:
        """Call a function with each process that ends by itself, on the loop's thread."""
        self._deaths.append(callback)

    def find(self, name: str) -> Process:
        """Return the process of a node.

        Raises:
            NotFoundError: If this launch has no such node.
        """
        known = {process.node.full_name: process for process in self.processes}
        found = known.get(f"/{name.strip('/')}")
        if found is None:
            listing = f"; it has {', '.join(known)}" if known else ""
            raise NotFoundError(
                f"this launch has no node '{name}'{near_miss(name, known) or listing}"
            )
        return found

    def stop(self, process: Process, done: Callable[[], None]) -> None:
        """End one process for good, then call a function."""
        self._console.say(f"[{process.label}] kill requested")
        if process.over:
            done()
            return
        self._callbacks.setdefault(process.owner, []).append(done)
        process.stop()

    def restart(self, process: Process, done: Callable[[], None]) -> None:
        """End one process if it runs, start it again, and call a function when it has started."""
        self._console.say(f"[{process.label}] restart requested")
        self._callbacks.setdefault(process.owner, []).append(done)
        process.restart()

    def shutdown(self) -> None:
        """End all processes, then stop the loop; a second call has no effect."""
        if self.closing:
            return
        self.closing = True
        for process in reversed(self.processes):
            if process.state is State.RUNNING:
                self._console.say(f"[{process.label}] killing on exit")
            process.stop()
        self._end_when_over()

    def kill(self) -> None:
        """End all processes with SIGKILL, then stop the loop."""
        self.closing = True
        for process in self.processes:
            process.kill()
        self._end_when_over()

    # Reports of processes.

    def waiting(self, process: Process, wait: Wait) -> None:
        """Report that a process waits before it starts."""
        wanted = " or ".join(map(str, wait.any_of))
        self._console.say(f"[{process.label}] waiting for {wanted} (at most {wait.timeout:g} s)")

    def started(self, process: Process) -> None:
        """Report that a process runs."""
        if process.child is not None:
            where = f" on {process.place}" if process.place else ""
            self._console.strong(
                f"process[{process.label}]: started with pid [{process.child.pid}]{where}"
            )
            self._console.note(f"process[{process.label}]: {process.child.shown}")
        self._call_back(process)

    def failed_to_start(self, process: Process, error: RoszError) -> None:
        """Report that a process cannot be started."""
        node = process.node
        what = f"{node.package}/{node.type}" if node.package else node.full_name
        if node.members:
            what = " + ".join(f"{one.package}/{one.type}" for one in node.members)
        self._console.error(f"ERROR: cannot launch node of type [{what}]: {error}")
        self.failed = True
        self.failures.append(process)
        if node.required and not self.closing:
            self._console.error(f"REQUIRED process [{process.label}] cannot be started\n")
            self.shutdown()

    def died(self, process: Process) -> None:
        """Report that a process ended by itself, and end the others if it was required."""
        for callback in self._deaths:
            callback(process)
        text = self._describe_death(process)
        if process not in self.failures and (process.code != 0 or process.node.required):
            self.failures.append(process)
        if process.node.required:
            self._console.error(
                f"{_RULE}REQUIRED process [{process.label}] has died!\n{text}\n"
                f"Initiating shutdown!\n{_RULE}"
            )
            self.failed = self.failed or process.code != 0
            self.shutdown()
        elif process.code != 0:
            self._console.error(f"[{process.label}] {text}")
        else:
            self._console.strong(f"[{process.label}] {text}")

    @staticmethod
    def _describe_death(process: Process) -> str:
        child = process.child
        nodes = ", ".join(member.full_name for member in process.node.members)
        what = f"process of nodes {nodes}" if nodes else "process"
        text = f"{what} has finished cleanly"
        if process.lost and child is not None:
            text = (
                f"{what} is lost with its machine [pid {child.pid} on {process.place}, exit code"
                f" unknown, cmd {child.shown}]."
            )
        elif process.code and child is not None:
            text = (
                f"{what} has died [pid {child.pid}, exit code {process.code}, cmd {child.shown}]."
            )
        if child is None or not child.logs:
            return text
        where = f"{process.place}:" if process.place else ""
        return f"{text}\nlog file: {where}{child.logs}"

    def respawning(self, process: Process) -> None:
        """Report that a process starts again."""
        self._console.say(f"[{process.label}] restarting process")

    def escalating(self, process: Process, number: int) -> None:
        """Report that a process did not end in time and gets a stronger signal."""
        self._console.error(f"[{process.label}] escalating to {signal.Signals(number).name}")
        if process.killed and process not in self.failures:
            self.failures.append(process)

    def finished(self, process: Process) -> None:
        """Handle the final end of a process and its descendants."""
        self._call_back(process)
        self._end_when_over()

    def _call_back(self, process: Process) -> None:
        for done in self._callbacks.pop(process.owner, []):
            done()

    def _end_when_over(self) -> None:
        if not all(process.over for process in self.processes):
            return
        if not self.closing:
            if self._stay or not self._begun:
                return
            self._console.say("all processes on machine have died, rosz launch will exit")
        self.closing = True
        self.loop.stop()
