"""The test programs of ROS 1's package rostest."""

# ruff: noqa: PT009  # unittest is what rostest runs

from __future__ import annotations

import threading
import time
import unittest
from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from typing import Any

import msgspec

from rosz.ros1.client import rospy
from rosz.ros1.tools import rosservice

_LOOK_SECONDS = 0.05
# Defaults of rostest's own programs.
_WAIT_SECONDS = 20
_CLOCK_SECONDS = 10
_FEWEST = 2


class _Expected(msgspec.Struct, frozen=True):
    """A topic or service that appears within seconds, or must not; of any type if it has none."""

    name: str
    timeout: float = 10
    type: str | None = None
    negative: bool = False


class AdvertiseTest(unittest.TestCase):
    """Checks that the topics and services of two parameters are advertised, or are not."""

    def setUp(self) -> None:
        """Read the parameters."""
        self.topics = _expectations("~topics")
        self.services = _expectations("~services")
        if not self.topics and not self.services:
            self.fail("No topic or service is specified in rosparam.")

    def test_advertise_topics(self) -> None:
        """Topics have publishers."""
        self._check("Topic", self.topics, lambda: dict(rospy.get_published_topics()))

    def test_advertise_services(self) -> None:
        """Services have servers."""

        def types() -> dict[str, str | None]:
            names = {service.name for service in self.services} & {*rosservice.get_service_list()}
            return {name: rosservice.get_service_type(name) for name in names}

        self._check("Service", self.services, types)

    def _check(
        self, kind: str, expected: list[_Expected], types: Callable[[], Mapping[str, str | None]]
    ) -> None:
        began = time.monotonic()
        for target in sorted(expected, key=lambda each: each.timeout):
            left = target.timeout - (time.monotonic() - began)
            name = target.name
            came = _wait_until(lambda: name in types(), left)  # noqa: B023  # called in the loop
            what = "is" if target.negative else "is not"
            self.assertNotEqual(came, target.negative, f"{kind} [{target.name}] {what} advertised")
            if came and target.type is not None:
                self.assertEqual(
                    target.type, types().get(target.name), f"{kind} type of [{target.name}]"
                )


class ParamTest(unittest.TestCase):
    """The parameter that ``~param_name_target`` names is set within ``~wait_time`` seconds."""

    def test_param(self) -> None:
        """The parameter is set, to ``~param_value_expected`` if that is given."""
        name = rospy.get_param("~param_name_target", "")
        self.assertTrue(name, "ParamTest not initialized properly: no ~param_name_target")
        wait_time = float(rospy.get_param("~wait_time", _WAIT_SECONDS))
        self.assertTrue(
            _wait_until(lambda: rospy.has_param(name), wait_time),
            f"parameter [{name}] is not set within {wait_time:g} s",
        )
        expected = rospy.get_param("~param_value_expected", None)
        if expected:
            self.assertEqual(expected, rospy.get_param(name))


class PublishTest(unittest.TestCase):
    """Messages come on the topics of the parameter ``~topics``, or none do."""

    def test_publish(self) -> None:
        """Messages come within the timeouts."""
        if rospy.get_param("/use_sim_time", False):
            ticks = _wait_until(lambda: not rospy.get_rostime().is_zero(), _CLOCK_SECONDS)
            self.assertTrue(ticks, f"Timed out ({_CLOCK_SECONDS}s) of /clock publication.")
        topics = _expectations("~topics")
        self.assertTrue(topics, "No topic is specified in rosparam.")
        heard: set[str] = set()
        for topic in topics:
            rospy.Subscriber(topic.name, rospy.AnyMsg, lambda _, name: heard.add(name), topic.name)
        began = time.monotonic()
        for topic in sorted(topics, key=lambda target: target.timeout):
            left = topic.timeout - (time.monotonic() - began)
            came = _wait_until(partial(heard.__contains__, topic.name), left)
            what = "is" if topic.negative else "is not"
            self.assertNotEqual(came, topic.negative, f"Topic [{topic.name}] {what} published")


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
        came = _wait_until(lambda: self._times, self.wait_time)
        if self.hz:
            self.assertTrue(came, "no messages before timeout")
        else:
            self.assertFalse(came, "message received")
        end = self._now() + self.duration
        _wait_until(lambda: self._now() >= end, float("inf"))
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


def _expectations(param: str) -> list[_Expected]:
    try:
        return msgspec.convert(rospy.get_param(param, []), list[_Expected])
    except msgspec.ValidationError as error:
        raise AssertionError(f"parameter '{param}' is not valid: {error}") from error


def _wait_until(condition: Callable[[], Any], seconds: float) -> bool:
    """Wait until a condition holds, in wall time; return whether it does."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end or rospy.is_shutdown():
            return False
        time.sleep(_LOOK_SECONDS)
    return True
