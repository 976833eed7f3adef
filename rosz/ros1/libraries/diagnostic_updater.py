"""diagnostic_updater: a node's own diagnostics on /diagnostics (ROS wiki, diagnostic_updater).

``import *`` gives the names that ROS 1's gives.
"""

# ruff: noqa: N802  # ROS 1's names

from __future__ import annotations

import http.client as httplib
import math
import threading
from collections.abc import Callable
from typing import Any

from rosz.msgs.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rosz.ros1.client import rospy
from rosz.ros1.state import state

__all__ = (
    "ERROR",
    "OK",
    "WARN",
    "CompositeDiagnosticTask",
    "DiagnosedPublisher",
    "DiagnosticArray",
    "DiagnosticStatus",
    "DiagnosticStatusWrapper",
    "DiagnosticTask",
    "DiagnosticTaskVector",
    "FrequencyStatus",
    "FrequencyStatusParam",
    "FunctionDiagnosticTask",
    "HeaderlessTopicDiagnostic",
    "Heartbeat",
    "KeyValue",
    "TimeStampStatus",
    "TimeStampStatusParam",
    "TopicDiagnostic",
    "Updater",
    "httplib",
    "rospy",
    "threading",
)

OK = DiagnosticStatus.OK
WARN = DiagnosticStatus.WARN
ERROR = DiagnosticStatus.ERROR

_ONE = 1


class DiagnosticStatusWrapper(DiagnosticStatus):
    """A DiagnosticStatus that is easy to fill; it is published as one."""

    def summary(self, *args: Any) -> None:
        """Set level and message: ``summary(level, message)``, or those of a ``summary(status)``."""
        self.level, self.message = _parts(args)

    def clearSummary(self) -> None:
        """Set the level to OK and the message to nothing."""
        self.summary(OK, "")

    def mergeSummary(self, *args: Any) -> None:
        """Add another summary, given as to `summary`.

        The higher level stays. Of two that are OK, or of two that are not, both messages stay, with
        a semicolon between them; otherwise that of the one that is not OK.
        """
        level, message = _parts(args)
        if (level > OK) == (self.level > OK):
            self.message = f"{self.message}; {message}" if self.message else message
        elif level > self.level:
            self.message = message
        self.level = max(self.level, level)

    def add(self, key: str, val: Any) -> None:
        """Add a detail, as text."""
        self.values.append(KeyValue(key, str(val)))


def _parts(args: tuple[Any, ...]) -> tuple[int, str]:
    if len(args) == _ONE:
        return args[0].level, args[0].message
    level, message = args
    return level, str(message)


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
    """A task that calls a function with the status; the function returns the status."""

    def __init__(self, name: str, fn: Function) -> None:
        super().__init__(name)
        self.fn = fn

    def run(self, stat: Any) -> Any:
        """Call the function."""
        return self.fn(stat)


class CompositeDiagnosticTask(DiagnosticTask):
    """Several tasks that fill one status: its summary is made of those of all."""

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
        lock: Lock that protects the tasks.
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
        """Do nothing; subclasses may handle a new task here."""

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
            removed = next((task for task in self.tasks if task.name == name), None)
            if removed is not None:
                self.tasks.remove(removed)
        return removed is not None


class Updater(DiagnosticTaskVector):
    """Publishes the statuses of its tasks on ``/diagnostics``.

    Call `update` often; the tasks run once in ``~diagnostic_period`` seconds (1).

    Args:
        node: An rclpy node, whose timer runs the tasks; the node of the process when not given.
        period: Seconds between two runs by that timer.

    Attributes:
        period: Seconds between two runs of the tasks.
        hwid: Hardware ID of all statuses.
        verbose: Whether to log each status that is not OK.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
    """

    def __init__(self, node: Any = None, period: float = 1) -> None:
        super().__init__()
        self._node_name = rospy.get_name
        self._alone = node is None
        if self._alone:
            self.publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        else:
            state.clock = node.rosz_node.clock
            self._node_name = node.get_fully_qualified_name
            self.publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 1)
            node.create_timer(period, self.force_update)
        self.last_time = rospy.Time.now()
        self.last_time_period_checked = self.last_time
        self.period: float = period
        self.verbose = False
        self.hwid = ""
        self.warn_nohwid_done = False

    def setHardwareID(self, hwid: str) -> None:
        """Set the hardware ID; ``none`` for software without hardware."""
        self.hwid = hwid

    def update(self) -> None:
        """Run the tasks and publish, if the period has passed."""
        now = rospy.Time.now()
        if self._alone and now >= self.last_time_period_checked + rospy.Duration.from_sec(
            _PERIOD_CHECK
        ):
            self.period = rospy.get_param_cached("~diagnostic_period", 1)
            self.last_time_period_checked = now
        if now >= self.last_time + rospy.Duration.from_sec(self.period):
            self.force_update()

    def force_update(self) -> None:
        """Run the tasks and publish."""
        self.last_time = rospy.Time.now()
        with self.lock:
            statuses = [self._run(task) for task in self.tasks]
        if (
            not self.hwid
            and not self.warn_nohwid_done
            and not any(status.level for status in statuses)
        ):
            rospy.logwarn(
                "diagnostic_updater: no hardware ID is set; call setHardwareID, with 'none' for"
                " what has none"
            )
            self.warn_nohwid_done = True
        self.publish(statuses)

    def broadcast(self, lvl: int, msg: str) -> None:
        """Publish one summary for all tasks, without running them."""
        self.publish([DiagnosticStatusWrapper(lvl, task.name, str(msg)) for task in self.tasks])

    def publish(self, msg: Any) -> None:
        """Publish a status or a list of them, with the name of the node before theirs."""
        statuses: list[DiagnosticStatus] = msg if isinstance(msg, list) else [msg]
        for status in statuses:
            status.name = f"{self._node_name()[1:]}: {status.name}"
        array = DiagnosticArray(status=statuses)
        array.header.stamp = rospy.Time.now()
        self.publisher.publish(array)

    def addedTaskCallback(self, task: DiagnosticTaskVector.DiagnosticTaskInternal) -> None:
        """Publish that the node starts."""
        self.publish(DiagnosticStatusWrapper(OK, task.name, "Node starting up"))

    def _run(self, task: DiagnosticTaskVector.DiagnosticTaskInternal) -> DiagnosticStatusWrapper:
        status = DiagnosticStatusWrapper(ERROR, task.name, "No message was set", self.hwid)
        task.run(status)
        if self.verbose and status.level:
            rospy.logwarn("%s: level %s, %s", status.name, status.level, status.message)
        return status


class FrequencyStatusParam:
    """The frequencies that a `FrequencyStatus` expects.

    Attributes:
        freq_bound: Dictionary with the lowest frequency as ``min`` and perhaps the highest as
            ``max``, in Hz; it may be changed at any time.
        tolerance: Part of a bound by which a frequency may miss it.
        window_size: Number of runs of the task that it looks back.
    """

    def __init__(
        self, freq_bound: dict[str, float], tolerance: float = 0.1, window_size: int = 5
    ) -> None:
        self.freq_bound = freq_bound
        self.tolerance = tolerance
        self.window_size = window_size


class FrequencyStatus(DiagnosticTask):
    """A task that warns when events are too rare or too frequent.

    Args:
        params: The expected frequencies.
        name: Name of the status.
    """

    def __init__(self, params: FrequencyStatusParam, name: str = "FrequencyStatus") -> None:
        super().__init__(name)
        self.params = params
        self.lock = threading.Lock()
        self.clear()

    def clear(self) -> None:
        """Forget all events."""
        with self.lock:
            self.count = 0
            self.times = [rospy.Time.now()] * self.params.window_size
            self.seq_nums = [0] * self.params.window_size
            self.hist_indx = 0

    def tick(self) -> None:
        """Count an event."""
        with self.lock:
            self.count += 1

    def run(self, stat: Any) -> Any:
        """Fill a status with the frequency since the last runs."""
        with self.lock:
            now, at = rospy.Time.now(), self.hist_indx
            events = self.count - self.seq_nums[at]
            window = (now - self.times[at]).to_sec()
            self.seq_nums[at], self.times[at] = self.count, now
            self.hist_indx = (at + 1) % self.params.window_size
            total = self.count
        frequency = events / window if window else math.inf if events else 0.0
        bound = self.params.freq_bound
        lowest = bound["min"] * (1 - self.params.tolerance)
        highest = bound.get("max", math.inf) * (1 + self.params.tolerance)
        if not events:
            stat.summary(ERROR, "No events recorded.")
        elif frequency < lowest:
            stat.summary(WARN, "Frequency too low.")
        elif frequency > highest:
            stat.summary(WARN, "Frequency too high.")
        else:
            stat.summary(OK, "Desired frequency met")
        stat.add("Events in window", f"{events}")
        stat.add("Events since startup", f"{total}")
        stat.add("Duration of window (s)", f"{window:f}")
        stat.add("Actual frequency (Hz)", f"{frequency:f}")
        if bound.get("max") == bound["min"]:
            stat.add("Target frequency (Hz)", f"{bound['min']:f}")
        if bound["min"] > 0:
            stat.add("Minimum acceptable frequency (Hz)", f"{lowest:f}")
        if "max" in bound:
            stat.add("Maximum acceptable frequency (Hz)", f"{highest:f}")
        return stat


class TimeStampStatusParam:
    """The ages of stamps that a `TimeStampStatus` expects.

    Attributes:
        min_acceptable: Lowest age of a stamp in seconds; negative for one in the future.
        max_acceptable: Highest age of a stamp in seconds.
    """

    def __init__(self, min_acceptable: float = -1, max_acceptable: float = 5) -> None:
        self.max_acceptable = max_acceptable
        self.min_acceptable = min_acceptable


class TimeStampStatus(DiagnosticTask):
    """A task that reports stamps that are too old or too far in the future.

    Args:
        params: The expected ages; from -1 to 5 seconds when not given.
        name: Name of the status.
    """

    def __init__(
        self, params: TimeStampStatusParam | None = None, name: str = "Timestamp Status"
    ) -> None:
        super().__init__(name)
        self.params = params or TimeStampStatusParam()
        self.lock = threading.Lock()
        self.early_count = 0
        self.late_count = 0
        self.zero_count = 0
        self._forget()

    def _forget(self) -> None:
        self.zero_seen = False
        self.max_delta = 0.0
        self.min_delta = 0.0
        self.deltas_valid = False

    def tick(self, stamp: Any) -> None:
        """Note the stamp of an event, a Time or seconds."""
        seconds = stamp if isinstance(stamp, float) else stamp.to_sec()
        with self.lock:
            if seconds == 0:
                self.zero_seen = True
                return
            delta = rospy.Time.now().to_sec() - seconds
            self.max_delta = max(self.max_delta, delta) if self.deltas_valid else delta
            self.min_delta = min(self.min_delta, delta) if self.deltas_valid else delta
            self.deltas_valid = True

    def run(self, stat: Any) -> Any:
        """Fill a status with the ages since the last run."""
        with self.lock:
            stat.summary(OK, "Timestamps are reasonable.")
            if not self.deltas_valid:
                stat.summary(WARN, "No data since last update.")
            else:
                self._judge(stat)
            stat.add("Earliest timestamp delay:", f"{self.min_delta:f}")
            stat.add("Latest timestamp delay:", f"{self.max_delta:f}")
            stat.add("Earliest acceptable timestamp delay:", f"{self.params.min_acceptable:f}")
            stat.add("Latest acceptable timestamp delay:", f"{self.params.max_acceptable:f}")
            stat.add("Late diagnostic update count:", f"{self.late_count}")
            stat.add("Early diagnostic update count:", f"{self.early_count}")
            stat.add("Zero seen diagnostic update count:", f"{self.zero_count}")
            self._forget()
        return stat

    def _judge(self, stat: Any) -> None:
        if self.min_delta < self.params.min_acceptable:
            stat.summary(ERROR, "Timestamps too far in future seen.")
            self.early_count += 1
        if self.max_delta > self.params.max_acceptable:
            stat.summary(ERROR, "Timestamps too far in past seen.")
            self.late_count += 1
        if self.zero_seen:
            stat.summary(ERROR, "Zero timestamp seen.")
            self.zero_count += 1


class Heartbeat(DiagnosticTask):
    """A task that says that the node lives."""

    def __init__(self) -> None:
        super().__init__("Heartbeat")

    def run(self, stat: Any) -> Any:
        """Fill a status that is OK."""
        stat.summary(OK, "Alive")
        return stat


class HeaderlessTopicDiagnostic(CompositeDiagnosticTask):
    """Watches the frequency of a topic.

    Args:
        name: Name of the topic.
        diag: Updater that the task is added to.
        freq: Frequency that is expected.
    """

    def __init__(self, name: str, diag: Updater, freq: FrequencyStatusParam) -> None:
        super().__init__(f"{name} topic status")
        self.diag = diag
        self.freq = FrequencyStatus(freq)
        self.addTask(self.freq)
        diag.add(self)

    def tick(self) -> None:
        """Count a message."""
        self.freq.tick()

    def clear_window(self) -> None:
        """Forget all messages."""
        self.freq.clear()


class TopicDiagnostic(HeaderlessTopicDiagnostic):
    """Watches the frequency of a topic and the ages of its stamps.

    Args:
        name: As for `HeaderlessTopicDiagnostic`, as are ``diag`` and ``freq``.
        stamp: Ages that are expected.
    """

    def __init__(
        self, name: str, diag: Updater, freq: FrequencyStatusParam, stamp: TimeStampStatusParam
    ) -> None:
        super().__init__(name, diag, freq)
        self.stamp = TimeStampStatus(stamp)
        self.addTask(self.stamp)

    def tick(self, stamp: Any) -> None:  # type: ignore[override]  # as in ROS 1
        """Count a message of a stamp."""
        self.stamp.tick(stamp)
        super().tick()


class DiagnosedPublisher(TopicDiagnostic):
    """A publisher whose messages are watched; they have a header.

    Args:
        pub: The publisher.
        diag: As for `TopicDiagnostic`, as are ``freq`` and ``stamp``.
    """

    def __init__(
        self, pub: Any, diag: Updater, freq: FrequencyStatusParam, stamp: TimeStampStatusParam
    ) -> None:
        super().__init__(pub.name, diag, freq, stamp)
        self.publisher = pub

    def publish(self, message: Any) -> None:
        """Count a message and publish it."""
        self.tick(message.header.stamp)
        self.publisher.publish(message)
