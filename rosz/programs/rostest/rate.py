"""hztest: a topic has a rate."""

# ruff: noqa: PT009  # unittest is what rostest runs

from __future__ import annotations

import threading
import time
import unittest
from itertools import pairwise
from typing import Any

from rosz.programs.rostest.waiting import wait_until
from rosz.ros1 import rospy

__all__ = ("HzTest",)

_WAIT_SECONDS = 20
_FEWEST = 2


class HzTest(unittest.TestCase):
    """The topic ``~topic`` has the rate ``~hz``, give or take ``~hzerror``; 0 for no message.

    It is measured for ``~test_duration`` seconds from the first message on, which comes within
    ``~wait_time`` seconds. ``~check_intervals`` measures each interval as well; ``~wall_clock``
    measures in wall time.
    """

    def setUp(self) -> None:
        """Read the parameters."""
        try:
            self.hz = float(rospy.get_param("~hz"))
            self.duration = float(rospy.get_param("~test_duration"))
            self.topic = str(rospy.get_param("~topic"))
            self.error = float(rospy.get_param("~hzerror")) if self.hz else 0.0
        except KeyError as error:
            self.fail(f"hztest not initialized properly. Parameter [{error}] not set.")
        self.wait_time = float(rospy.get_param("~wait_time", _WAIT_SECONDS))
        self.check_intervals = bool(rospy.get_param("~check_intervals", False))
        self.wall_clock = bool(rospy.get_param("~wall_clock", False))
        self.assertGreaterEqual(self.hz, 0.0, "bad parameter (hz)")
        self.assertGreaterEqual(self.error, 0.0, "bad parameter (hzerror)")
        self.assertGreater(self.duration, 0.0, "bad parameter (test_duration)")
        self._lock = threading.Lock()
        self._times: list[float] = []

    def test_hz(self) -> None:
        """Messages come at the rate."""
        subscriber = rospy.Subscriber(self.topic, rospy.AnyMsg, self._hear)
        came = wait_until(lambda: self._times, self.wait_time)
        if self.hz:
            self.assertTrue(came, "no messages before timeout")
        else:
            self.assertFalse(came, "message received")
        self._measure()
        subscriber.unregister()
        with self._lock:
            times = list(self._times)
        if self.hz:
            self._check(times)
        else:
            self.assertEqual(0, len(times))

    def _now(self) -> float:
        return time.time() if self.wall_clock else float(rospy.get_time())

    def _hear(self, _: Any) -> None:
        now = self._now()
        with self._lock:
            if self._times and now < self._times[0]:  # simulated time begins anew
                self._times.clear()
            if now > 0:
                self._times.append(now)

    def _measure(self) -> None:
        end = self._now() + self.duration
        wait_until(lambda: self._now() >= end, float("inf"))

    def _check(self, times: list[float]) -> None:
        self.assertGreaterEqual(len(times), _FEWEST, "only one message received")
        low, high = self.hz - self.error, self.hz + self.error
        rate = (len(times) - 1) / (times[-1] - times[0])
        self.assertGreaterEqual(rate, low, f"average rate ({rate:.3f}Hz) is below {low:.3f}Hz")
        self.assertLessEqual(rate, high, f"average rate ({rate:.3f}Hz) is above {high:.3f}Hz")
        intervals = [b - a for a, b in pairwise(times)]
        for interval in intervals if self.check_intervals else ():
            self.assertGreaterEqual(interval, 1 / high, "min_interval exceeded")
            if low > 0:
                self.assertLessEqual(interval, 1 / low, "max_interval exceeded")
