"""Tasks that fill a status, and the updater that runs and publishes them."""

# ruff: noqa: N802  # ROS 1's names

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from rosz.msgs.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rosz.ros1 import rospy
from rosz.ros1.diagnostic_updater._diagnostic_status_wrapper import (
    ERROR,
    OK,
    DiagnosticStatusWrapper,
)

__all__ = (
    "CompositeDiagnosticTask",
    "DiagnosticTask",
    "DiagnosticTaskVector",
    "FunctionDiagnosticTask",
    "Updater",
)

Function = Callable[[Any], Any]
_PERIOD_CHECK = 0.25
"""Seconds between two looks at the parameter of the period."""


class DiagnosticTask:
    """A task that fills one status; subclasses override `run`.

    Args:
        name: Name of the status.
    """

    def __init__(self, name: str) -> None:
        self.name = name

    def getName(self) -> str:
        """Return the name of the status."""
        return self.name

    def run(self, stat: Any) -> Any:
        """Fill a status and return it."""
        return stat


class FunctionDiagnosticTask(DiagnosticTask):
    """A task that calls a function with the status.

    Args:
        name: Name of the status.
        fn: The function; it returns the status.
    """

    def __init__(self, name: str, fn: Function) -> None:
        super().__init__(name)
        self.fn = fn

    def run(self, stat: Any) -> Any:
        """Call the function."""
        return self.fn(stat)


class CompositeDiagnosticTask(DiagnosticTask):
    """Several tasks that fill one status: its summary is made of those of all.

    Args:
        name: Name of the status.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.tasks: list[DiagnosticTask] = []

    def addTask(self, t: DiagnosticTask) -> None:
        """Add a task."""
        self.tasks.append(t)

    def run(self, stat: Any) -> Any:
        """Run all tasks."""
        given, combined = DiagnosticStatusWrapper(), DiagnosticStatusWrapper()
        given.summary(stat)
        for task in self.tasks:
            stat.summary(given)
            stat = task.run(stat)
            combined.mergeSummary(stat)
        stat.summary(combined)
        return stat


class DiagnosticTaskVector:
    """The tasks of an `Updater`.

    Attributes:
        tasks: The tasks.
        lock: Guard of the tasks.
    """

    class DiagnosticTaskInternal:
        """A name and the function that fills its status."""

        def __init__(self, name: str, fn: Function) -> None:
            self.name = name
            self.fn = fn

        def run(self, stat: Any) -> Any:
            """Name a status and fill it."""
            stat.name = self.name
            return self.fn(stat)

    def __init__(self) -> None:
        self.tasks: list[DiagnosticTaskVector.DiagnosticTaskInternal] = []
        self.lock = threading.Lock()

    def addedTaskCallback(self, task: DiagnosticTaskInternal) -> None:
        """Do what a subclass does for a task that was added."""

    def add(self, *args: Any) -> None:
        """Add a task: ``add(task)``, or ``add(name, function)``."""
        name, function = (args[0].getName(), args[0].run) if len(args) == 1 else args
        task = self.DiagnosticTaskInternal(name, function)
        with self.lock:
            self.tasks.append(task)
            self.addedTaskCallback(task)

    def removeByName(self, name: str) -> bool:
        """Remove the first task of a name; return whether there was one."""
        with self.lock:
            found = next((task for task in self.tasks if task.name == name), None)
            if found is not None:
                self.tasks.remove(found)
        return found is not None


class Updater(DiagnosticTaskVector):
    """Publishes what its tasks say on ``/diagnostics``.

    Call `update` often; the tasks run once in ``~diagnostic_period`` seconds (1).

    Attributes:
        period: Seconds between two runs of the tasks.
        hwid: Hardware ID of all statuses.
        verbose: Whether to log each status that is not OK.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
    """

    def __init__(self) -> None:
        super().__init__()
        self.publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self.last_time = rospy.Time.now()
        self.last_time_period_checked = self.last_time
        self.period: float = 1
        self.verbose = False
        self.hwid = ""
        self.warn_nohwid_done = False

    def setHardwareID(self, hwid: str) -> None:
        """Set the hardware ID; ``none`` for what has none."""
        self.hwid = hwid

    def update(self) -> None:
        """Run the tasks and publish, if the period has passed."""
        self._check_diagnostic_period()
        if rospy.Time.now() >= self.last_time + rospy.Duration.from_sec(self.period):
            self.force_update()

    def force_update(self) -> None:
        """Run the tasks and publish."""
        self.last_time = rospy.Time.now()
        with self.lock:
            statuses = [self._run(task) for task in self.tasks]
        if not self.hwid and not self.warn_nohwid_done and not any(one.level for one in statuses):
            rospy.logwarn(
                "diagnostic_updater: no hardware ID is set; call setHardwareID, with 'none' for"
                " what has none"
            )
            self.warn_nohwid_done = True
        self.publish(statuses)

    def broadcast(self, lvl: int, msg: str) -> None:
        """Publish one summary for all tasks, without running them."""
        statuses = []
        for task in self.tasks:
            status = DiagnosticStatusWrapper(name=task.name)
            status.summary(lvl, msg)
            statuses.append(status)
        self.publish(statuses)

    def publish(self, msg: Any) -> None:
        """Publish a status or a list of them, with the name of the node before theirs."""
        statuses: list[DiagnosticStatus] = msg if isinstance(msg, list) else [msg]
        for status in statuses:
            status.name = f"{rospy.get_name()[1:]}: {status.name}"
        array = DiagnosticArray(status=statuses)
        array.header.stamp = rospy.Time.now()
        self.publisher.publish(array)

    def addedTaskCallback(self, task: DiagnosticTaskVector.DiagnosticTaskInternal) -> None:
        """Publish that the node starts."""
        status = DiagnosticStatusWrapper(name=task.name)
        status.summary(OK, "Node starting up")
        self.publish(status)

    def _run(self, task: DiagnosticTaskVector.DiagnosticTaskInternal) -> DiagnosticStatusWrapper:
        status = DiagnosticStatusWrapper(name=task.name, hardware_id=self.hwid)
        status.summary(ERROR, "No message was set")
        task.run(status)
        if self.verbose and status.level:
            rospy.logwarn("%s: level %s, %s", status.name, status.level, status.message)
        return status

    def _check_diagnostic_period(self) -> None:
        now = rospy.Time.now()
        if now >= self.last_time_period_checked + rospy.Duration.from_sec(_PERIOD_CHECK):
            self.period = rospy.get_param_cached("~diagnostic_period", 1)
            self.last_time_period_checked = now
