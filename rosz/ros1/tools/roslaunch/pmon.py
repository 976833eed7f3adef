"""roslaunch.pmon: the running processes of a launch, and listeners for their ends."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from rosz.errors import LaunchError, NotFoundError, ParamError, RoszError, TransportError
from rosz.launch.plan import NodePlan, Plan
from rosz.launch.run import LaunchProcess, Network, Options, Runner, Supervisor, Workplace
from rosz.ros1.exceptions import raised_as
from rosz.ros1.importer import package_path
from rosz.ros1.state import ready_context
from rosz.ros1.tools.roslaunch.core import RLException
from rosz.worker import Worker

_POLL_SECONDS = 0.1
_monitors: list[ProcessMonitor] = []


class FatalProcessLaunch(RLException):
    """A process cannot be started."""


class ProcessListener:
    """Base class of objects that are notified of the ends of processes."""

    def process_died(self, process_name: str, exit_code: int | None) -> None:
        """Handle the end of a process that nobody asked for.

        Args:
            process_name: Name of the process.
            exit_code: Its exit code, or None if it is unknown.
        """


class Process:
    """A process of a launch.

    Attributes:
        name: Its name in messages.
        package: Package of its program.
        required: Whether the launch ends with it.
        respawn: Whether it is started again.
    """

    def __init__(self, monitor: ProcessMonitor, process: LaunchProcess) -> None:
        self._monitor = monitor
        self._process = process
        self.name = process.label
        self.package = process.node.package
        self.required = process.node.required
        self.respawn = process.node.respawn

    @property
    def exit_code(self) -> int | None:
        """Exit code of the latest process, or None."""
        return self._process.code

    @property
    def pid(self) -> int:
        """Process id of the latest process, or -1."""
        return self._process.child.pid if self._process.child is not None else -1

    @property
    def spawn_count(self) -> int:
        """Number of starts."""
        return self._process.starts

    @property
    def args(self) -> list[str]:
        """Command line of the latest process."""
        return self._process.child.shown.split() if self._process.child is not None else []

    def is_alive(self) -> bool:
        """Return whether it runs, or is started again."""
        return not self._process.over

    def should_respawn(self) -> bool:
        """Return whether it is started again when it ends."""
        return self.respawn

    def stop(self, errors: list[str] | None = None) -> None:  # noqa: ARG002  # ROS 1's
        """End it, and wait for that."""
        self._monitor.stop_process(self._process)

    def get_exit_description(self) -> str:
        """Return how it ended, in words."""
        return self._process.describe_end()

    def get_info(self) -> dict[str, Any]:
        """Return its properties."""
        return {
            "name": self.name,
            "alive": self.is_alive(),
            "spawn_count": self.spawn_count,
            "exit_code": self.exit_code,
            "pid": self.pid,
            "respawn": self.respawn,
            "required": self.required,
        }


class ProcessMonitor:
    """A launch on a thread of this process.

    Args:
        plan: Plan of the launch.
        options: The options.
    """

    def __init__(self, plan: Plan, options: Options) -> None:
        self._context = ready_context()
        self._listeners: list[Any] = []
        self._begun = threading.Event()
        self._ended = threading.Event()
        self._error: BaseException | None = None
        self._supervisor: Supervisor | None = None
        self._dead: list[Process] = []
        # On a thread of its own, so that a listener can end the launch and wait for that.
        self._notices = Worker[Callable[[], None]]("roslaunch-listeners", lambda notice: notice())
        environment = self._context.environment
        place = Workplace(package_path(), environment, dict(os.environ), str(Path.cwd()))
        with raised_as(RLException, RoszError):
            self._runner = Runner(
                plan,
                place,
                Network(self._context),
                options,
                out=sys.stdout,
                err=sys.stderr,
                begun=self._begin,
            )
        self._thread = threading.Thread(target=self._run, name="roslaunch", daemon=True)

    def start(self) -> None:
        """Set the parameters, and start the processes.

        Raises:
            RLException: The launch cannot begin.
        """
        _monitors.append(self)
        self._thread.start()
        self._begun.wait()
        if self._error is not None:
            raise RLException(str(self._error)) from self._error

    def _begin(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        supervisor.on_death(self._died)
        self._begun.set()

    def _run(self) -> None:
        try:
            self._runner.run()
        except (LaunchError, NotFoundError, ParamError, TransportError) as error:
            self._error = error
        finally:
            self._ended.set()
            self._begun.set()
            if self in _monitors:
                _monitors.remove(self)

    def _died(self, process: LaunchProcess) -> None:
        dead = Process(self, process)
        self._dead.append(dead)
        for listener in list(self._listeners):
            self._notices.submit(partial(self._notify, listener, dead))

    @staticmethod
    def _notify(listener: Any, dead: Process) -> None:
        try:
            listener.process_died(dead.name, dead.exit_code)
        except Exception as error:  # noqa: BLE001  # the callback boundary
            sys.stderr.write(f"roslaunch: listener {listener!r} failed on {dead.name}: {error}\n")

    def add_process_listener(self, l: Any) -> None:  # noqa: E741  # ROS 1's
        """Notify an object with ``process_died`` of each process that dies."""
        self._listeners.append(l)

    @property
    def dead_list(self) -> list[Process]:
        """The processes that died."""
        return list(self._dead)

    @property
    def procs(self) -> list[Process]:
        """The processes that run."""
        supervised = self._supervisor.processes if self._supervisor is not None else []
        processes = [Process(self, process) for process in list(supervised)]
        return [process for process in processes if process.is_alive()]

    @property
    def is_shutdown(self) -> bool:
        """Whether the launch is ending or has ended."""
        return self._ended.is_set() or (self._supervisor is not None and self._supervisor.closing)

    @property
    def done(self) -> bool:
        """Whether the launch has ended."""
        return self._ended.is_set()

    def is_alive(self) -> bool:
        """Return whether the launch goes on."""
        return self._thread.is_alive()

    def has_process(self, name: str) -> bool:
        """Return whether a process of a name runs."""
        return self.get_process(name) is not None

    def get_process(self, name: str) -> Process | None:
        """Return the running process of a name, or None."""
        return next((process for process in self.procs if process.name == name), None)

    def get_active_names(self) -> list[str]:
        """Return the names of the running processes."""
        return [process.name for process in self.procs]

    def get_process_names_with_spawn_count(self) -> list[list[tuple[str, int]]]:
        """Return the running and the dead processes with the numbers of their starts."""
        running, dead = self.procs, self._dead
        return [
            [(process.name, process.spawn_count) for process in group] for group in (running, dead)
        ]

    def kill_process(self, name: str) -> bool:
        """End a process, and wait for that; return whether there is one of that name.

        Raises:
            RLException: The name is not a string.
        """
        if not isinstance(name, str):
            raise RLException(f"kill_process takes in a process name but was given: {name}")
        process = self.get_process(name)
        if process is not None:
            process.stop()
        return process is not None

    def add(self, node: NodePlan) -> Process:
        """Start a further process.

        Raises:
            RLException: The launch has ended.
        """
        supervisor = self._running()
        made: list[LaunchProcess] = []
        added = threading.Event()

        def add() -> None:
            made.append(supervisor.add(node))
            added.set()

        supervisor.loop.post(add)
        self._wait(added)
        if not made:
            raise RLException("the launch has ended")
        return Process(self, made[0])

    def stop_process(self, process: LaunchProcess) -> None:
        """End one process, and wait for that."""
        ended = threading.Event()
        supervisor = self._running()
        supervisor.loop.post(lambda: supervisor.stop(process, ended.set))
        self._wait(ended)

    def _running(self) -> Supervisor:
        if self._supervisor is None:
            raise RLException("the launch has not begun")
        return self._supervisor

    def _wait(self, event: threading.Event) -> None:
        while not event.wait(_POLL_SECONDS) and not self._ended.is_set():
            pass

    def mainthread_spin_once(self) -> bool:
        """Return whether the launch goes on."""
        return not self._ended.is_set()

    def mainthread_spin(self) -> None:
        """Wait until the launch has ended; Ctrl-C ends it."""
        try:
            while not self._ended.wait(_POLL_SECONDS):
                pass
        except KeyboardInterrupt:
            self.shutdown()

    def join(self, timeout: float | None = None) -> None:
        """Wait until the launch has ended."""
        self._ended.wait(timeout)

    def shutdown(self) -> None:
        """End all processes, and wait for that; a second call has no effect."""
        if self._begun.is_set() and not self._ended.is_set():
            self._runner.stop()
            self._ended.wait()
        self._notices.close(0)


def pmon_shutdown() -> None:
    """End all launches of this process."""
    for monitor in _monitors.copy():
        monitor.shutdown()


def _init_signal_handlers() -> None:
    """Do nothing: Ctrl-C ends the function that waits for a launch, and the launch with it."""
