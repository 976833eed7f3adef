"""All processes of one launch: started in order, watched, ended together.

Says what happens in roslaunch's words. Ends by itself when a required process has ended, or when
all have and none comes back.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Sequence

from rosz.errors import NotFoundError, RoszError, near_miss
from rosz.launch.plan.model import NodePlan, Wait
from rosz.launch.run.console import Console
from rosz.launch.run.host import Host
from rosz.launch.run.loop import Loop
from rosz.launch.run.process import Process, Readiness, State, Timeouts

__all__ = ("Supervisor",)

_RULE = "=" * 80


class Supervisor:
    """The processes of a launch.

    Args:
        nodes: What to run, in order.
        host_of: Gives the machine of a node; may raise `LaunchError`.
        loop: What is waited with; stopped when all is over.
        console: Where it is said what happens.
        timeouts: How long processes may take to end.
        readiness: What nodes may wait for.
        stay: Whether it goes on when nothing runs any more.
    """

    def __init__(
        self,
        nodes: Sequence[NodePlan],
        host_of: Callable[[NodePlan], Host],
        loop: Loop,
        console: Console,
        *,
        timeouts: Timeouts,
        readiness: Readiness | None = None,
        stay: bool = False,
    ) -> None:
        self._loop = loop
        self._stay = stay
        self._console = console
        self._closing = False
        self._begun = False
        self._told: dict[int, list[Callable[[], None]]] = {}
        self.failed = False
        self.fallen: list[Process] = []
        self.processes = [
            Process(
                node,
                f"{node.full_name.strip('/')}-{number}",
                number,
                host_of(node),
                loop,
                self,
                timeouts=timeouts,
                readiness=readiness,
            )
            for number, node in enumerate(nodes, 1)
        ]

    @property
    def hosts(self) -> list[Host]:
        """All machines that its processes run on, each once."""
        return list({id(process.host): process.host for process in self.processes}.values())

    @property
    def closing(self) -> bool:
        """Whether the end has begun."""
        return self._closing

    def start(self) -> None:
        """Start all processes, each as soon as what it waits for is there."""
        for process in self.processes:
            if not self._closing:
                process.begin()
        self._begun = True
        self._end_when_over()

    def find(self, name: str) -> Process:
        """Return the process of a node.

        Raises:
            NotFoundError: This launch has no such node.
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
        """End one process for good, then call back."""
        self._console.say(f"[{process.label}] kill requested")
        if process.over:
            done()
            return
        self._told.setdefault(process.owner, []).append(done)
        process.stop()

    def restart(self, process: Process, done: Callable[[], None]) -> None:
        """End one process if it runs, and start it anew; call back when it has started."""
        self._console.say(f"[{process.label}] restart requested")
        self._told.setdefault(process.owner, []).append(done)
        process.restart()

    def shutdown(self) -> None:
        """End all processes, then stop the loop; again is no error."""
        if self._closing:
            return
        self._closing = True
        for process in reversed(self.processes):
            if process.state is State.RUNNING:
                self._console.say(f"[{process.label}] killing on exit")
            process.stop()
        self._end_when_over()

    def kill(self) -> None:
        """End all processes without asking, then stop the loop."""
        self._closing = True
        for process in self.processes:
            process.kill()
        self._end_when_over()

    def waiting(self, process: Process, wait: Wait) -> None:
        """Say that a process waits."""
        wanted = " or ".join(map(str, wait.any_of))
        self._console.say(f"[{process.label}] waiting for {wanted} (at most {wait.timeout:g} s)")

    def started(self, process: Process) -> None:
        """Say that a process runs."""
        if process.child is not None:
            where = f" on {process.place}" if process.place else ""
            self._console.strong(
                f"process[{process.label}]: started with pid [{process.child.pid}]{where}"
            )
            self._console.note(f"process[{process.label}]: {process.child.shown}")
        self._tell(process)

    def failed_to_start(self, process: Process, error: RoszError) -> None:
        """Say that a process cannot be started."""
        node = process.node
        what = f"{node.package}/{node.type}" if node.package else node.full_name
        self._console.error(f"ERROR: cannot launch node of type [{what}]: {error}")
        self.failed = True
        self.fallen.append(process)
        if node.required and not self._closing:
            self._console.error(f"REQUIRED process [{process.label}] cannot be started\n")
            self.shutdown()

    def died(self, process: Process) -> None:
        """Say that a process ended by itself, and end the others if it was required."""
        text = self._obituary(process)
        if process not in self.fallen and (process.code or process.node.required):
            self.fallen.append(process)
        if process.node.required:
            self._console.error(
                f"{_RULE}REQUIRED process [{process.label}] has died!\n{text}\n"
                f"Initiating shutdown!\n{_RULE}"
            )
            self.failed = self.failed or bool(process.code)
            self.shutdown()
        elif process.code:
            self._console.error(f"[{process.label}] {text}")
        else:
            self._console.strong(f"[{process.label}] {text}")

    def _obituary(self, process: Process) -> str:
        text = "process has finished cleanly"
        if process.code and process.child is not None:
            child = process.child
            text = (
                f"process has died [pid {child.pid}, exit code {process.code}, cmd {child.shown}]."
            )
        if process.child is None or not process.child.logs:
            return text
        where = f"{process.place}:" if process.place else ""
        return f"{text}\nlog file: {where}{process.child.logs}"

    def respawning(self, process: Process) -> None:
        """Say that a process starts again."""
        self._console.say(f"[{process.label}] restarting process")

    def escalating(self, process: Process, number: int) -> None:
        """Say that a process did not end in time."""
        self._console.error(f"[{process.label}] escalating to {signal.Signals(number).name}")
        if process.killed and process not in self.fallen:
            self.fallen.append(process)

    def settled(self, process: Process) -> None:
        """See whether that was the last one."""
        self._tell(process)
        self._end_when_over()

    def _tell(self, process: Process) -> None:
        for done in self._told.pop(process.owner, []):
            done()

    def _end_when_over(self) -> None:
        if not all(process.over for process in self.processes):
            return
        if not self._closing:
            if self._stay or not self._begun:
                return
            self._console.say("all processes on machine have died, rosz launch will exit")
        self._closing = True
        self._loop.stop()
