"""One node of a launch, from its waits to its end: when it starts, ends, starts again."""

from __future__ import annotations

import signal
from collections.abc import Callable
from enum import Enum
from functools import partial
from typing import Protocol

import msgspec

from rosz.errors import LaunchError, RoszError
from rosz.launch.plan.model import Condition, NodePlan, Wait
from rosz.launch.run.host import Child, Host, Job
from rosz.launch.run.loop import Loop, Timer

__all__ = ("Listener", "Process", "Readiness", "State", "Timeouts")

_SHORTEST_RESPAWN = 0.1
"""Seconds between a death and the next start at least, so that a broken node starves nobody."""
_LOOK_FIRST, _LOOK_LONGEST = 0.005, 0.1
_READY_EVERY = 0.05
_AFTER_SIGKILL = 1.0
"""Seconds after which a process that SIGKILL did not end is left to the system."""


class Timeouts(msgspec.Struct, frozen=True):
    """How long processes may take to end.

    Attributes:
        sigint: Seconds from SIGINT to SIGTERM.
        sigterm: Seconds from SIGTERM to SIGKILL.
    """

    sigint: float = 15.0
    sigterm: float = 2.0


class State(Enum):
    """Where a process stands."""

    WAITING = "waiting"
    RUNNING = "running"
    STOPPING = "stopping"
    RESPAWNING = "respawning"
    ENDED = "ended"
    FAILED = "failed"


class Readiness(Protocol):
    """What nodes can wait for."""

    def holds(self, condition: Condition) -> bool:
        """Tell whether something is so by now."""


class Listener(Protocol):
    """Whoever is told what becomes of processes."""

    def waiting(self, process: Process, wait: Wait) -> None:
        """Take note that it waits before it starts."""

    def started(self, process: Process) -> None:
        """Take note that it runs."""

    def failed_to_start(self, process: Process, error: RoszError) -> None:
        """Take note that it could not be started, and never will."""

    def died(self, process: Process) -> None:
        """Take note that it ended without being asked to."""

    def respawning(self, process: Process) -> None:
        """Take note that it is about to start again."""

    def escalating(self, process: Process, number: int) -> None:
        """Take note that it did not end in time, and gets a stronger signal."""

    def settled(self, process: Process) -> None:
        """Take note that it has ended for good, with all it started."""


class Process:
    """One node and the processes that it becomes one after the other.

    Args:
        node: What to run.
        label: What messages call it.
        owner: Its number in the launch.
        host: Where it runs.
        loop: What it waits with.
        listener: Told of all that happens.
        timeouts: How long it may take to end.
    """

    def __init__(
        self,
        node: NodePlan,
        label: str,
        owner: int,
        host: Host,
        loop: Loop,
        listener: Listener,
        *,
        timeouts: Timeouts,
        readiness: Readiness | None = None,
    ) -> None:
        self.node = node
        self.label = label
        self.owner = owner
        self.state = State.WAITING
        self.child: Child | None = None
        self.code: int | None = None
        self.tail: tuple[str, ...] = ()
        self.error = ""
        self.starts = 0
        self.began = 0.0
        self.ended = 0.0
        self.killed = False
        self.host = host
        self._loop = loop
        self._listener = listener
        self._timeouts = timeouts
        self._readiness = readiness
        self._timers: list[Timer] = []
        self.alive = False
        self._again = False

    @property
    def over(self) -> bool:
        """Whether nothing of it runs, and nothing will unless asked for."""
        return self.state in {State.ENDED, State.FAILED}

    def begin(self) -> None:
        """Wait for what the node waits for, then start it."""
        self.state = State.WAITING
        self._await(self.node.wait_for)

    def _await(self, waits: tuple[Wait, ...]) -> None:
        if not waits:
            self._after(self.node.spawn_delay, self._start)
            return
        wait, *later = waits
        deadline = self._loop.now() + wait.timeout

        def look() -> None:
            if self._readiness is None or any(map(self._readiness.holds, wait.any_of)):
                self._await(tuple(later))
            elif self._loop.now() >= deadline:
                wanted = " or ".join(map(str, wait.any_of))
                self._fail(LaunchError(f"{wait.place}: no {wanted} within {wait.timeout:g} s"))
            else:
                self._after(_READY_EVERY, look)

        self._listener.waiting(self, wait)
        look()

    def _after(self, seconds: float, action: Callable[[], None]) -> None:
        if seconds > 0:
            self._timers.append(self._loop.later(seconds, action))
        else:
            action()

    def _start(self) -> None:
        self._cancel_timers()
        job = Job(self.node, self.owner, self.label, again=self.starts > 0)
        which = self.starts + 1
        try:
            self.child = self.host.start(
                job, partial(self._exited, which), partial(self._confirmed, which)
            )
        except RoszError as error:
            self._fail(error)
            return
        self.state = State.RUNNING
        self.alive = True
        self._again = False
        self.code = None
        self.tail = ()
        self.starts = which
        self.began = self._loop.now()
        if not self.child.pending:
            self._listener.started(self)

    def _given_up(self, which: int) -> bool:
        """Tell whether nobody waits any more for one of the processes that this was."""
        return self.over or which != self.starts

    def _confirmed(self, which: int, error: RoszError | None) -> None:
        """Take note of what another machine says to a start."""
        if self._given_up(which):
            return
        if error is None:
            self._listener.started(self)
            return
        self.alive = False
        self._fail(error)

    @property
    def place(self) -> str:
        """Address of its machine; empty for this one."""
        return self.host.place

    def _fail(self, error: RoszError) -> None:
        self._cancel_timers()
        self.state = State.FAILED
        self.error = str(error)
        self._listener.failed_to_start(self, error)
        self._listener.settled(self)

    def _exited(self, which: int, code: int, tail: tuple[str, ...]) -> None:
        if self._given_up(which):
            return
        asked = self.state is State.STOPPING
        self.code = code
        self.tail = tail
        self.ended = self._loop.now()
        self.alive = False
        self.state = State.STOPPING
        if not asked:
            self._again = self._may_respawn()
            self._listener.died(self)
            self._escalate((signal.SIGTERM, 0.0), (signal.SIGKILL, self._timeouts.sigterm))
        self._look(_LOOK_FIRST)

    def _may_respawn(self) -> bool:
        most = self.node.respawn_max
        return self.node.respawn and (most is None or self.starts <= most)

    def stop(self) -> None:
        """End it: SIGINT, and what follows when that does not help."""
        self._again = False
        if self.state is State.RUNNING:
            self.state = State.STOPPING
            self._escalate(
                (signal.SIGINT, 0.0),
                (signal.SIGTERM, self._timeouts.sigint),
                (signal.SIGKILL, self._timeouts.sigint + self._timeouts.sigterm),
            )
        elif self.state in {State.WAITING, State.RESPAWNING}:
            self._settle()

    def kill(self) -> None:
        """End it without asking."""
        self.stop()
        if self.child is not None and not self.over:
            self._cancel_timers()
            self._escalate((signal.SIGKILL, 0.0))
            if not self.alive:
                self._look(_LOOK_FIRST)

    def restart(self) -> None:
        """End it if it runs, and start it anew, whatever the plan says of respawning."""
        if self.over:
            self._start()
            return
        waiting = self.state in {State.WAITING, State.RESPAWNING}
        if waiting:
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
            self._listener.escalating(self, number)
        self.child.signal(number)

    def _look(self, patience: float) -> None:
        """Go on once the whole process group is gone."""
        if self.child is None or not self.child.remains():
            self._gone()
        else:
            following = min(2 * patience, _LOOK_LONGEST)
            self._timers.append(self._loop.later(patience, lambda: self._look(following)))

    def _give_up(self) -> None:
        """Stop waiting for what not even SIGKILL ends, such as a process stuck in a driver."""
        if self.alive:  # as far as anybody knows here
            self.ended = self._loop.now()
        self._gone()

    def _gone(self) -> None:
        self._cancel_timers()
        if not self._again:
            self._settle()
            return
        self.state = State.RESPAWNING
        due = self.ended + max(self.node.respawn_delay, _SHORTEST_RESPAWN)

        def again() -> None:
            self._listener.respawning(self)
            self._start()

        self._after(due - self._loop.now(), again)

    def _settle(self) -> None:
        self._cancel_timers()
        self.state = State.ENDED
        self._listener.settled(self)

    def _cancel_timers(self) -> None:
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()
