"""Tasks that watch how often something happens, and how old its stamps are."""

from __future__ import annotations

import math
import threading
from typing import Any

from rosz.ros1 import rospy
from rosz.ros1.diagnostic_updater._diagnostic_status_wrapper import ERROR, OK, WARN
from rosz.ros1.diagnostic_updater._diagnostic_updater import DiagnosticTask

__all__ = (
    "FrequencyStatus",
    "FrequencyStatusParam",
    "Heartbeat",
    "TimeStampStatus",
    "TimeStampStatusParam",
)


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
        params: What is expected.
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
        """Fill a status with what the frequency was."""
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
        params: What is expected; from -1 to 5 seconds when not given.
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
