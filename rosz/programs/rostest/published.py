"""publishtest: messages come on topics."""

# ruff: noqa: PT009  # unittest is what rostest runs

from __future__ import annotations

import time
import unittest
from functools import partial

from rosz.programs.rostest.waiting import expectations, wait_until
from rosz.ros1 import rospy

__all__ = ("PublishTest",)

_CLOCK_SECONDS = 10


class PublishTest(unittest.TestCase):
    """Messages come on the topics of the parameter ``~topics``, or none do."""

    def test_publish(self) -> None:
        """Messages come within the timeouts."""
        if rospy.get_param("/use_sim_time", False):
            ticks = wait_until(lambda: not rospy.get_rostime().is_zero(), _CLOCK_SECONDS)
            self.assertTrue(ticks, f"Timed out ({_CLOCK_SECONDS}s) of /clock publication.")
        topics = expectations("~topics")
        self.assertTrue(topics, "No topic is specified in rosparam.")
        heard: set[str] = set()
        for topic in topics:
            rospy.Subscriber(topic.name, rospy.AnyMsg, lambda _, name: heard.add(name), topic.name)
        began = time.monotonic()
        for topic in sorted(topics, key=lambda one: one.timeout):
            left = topic.timeout - (time.monotonic() - began)
            came = wait_until(partial(heard.__contains__, topic.name), left)
            what = "is" if topic.negative else "is not"
            self.assertNotEqual(came, topic.negative, f"Topic [{topic.name}] {what} published")
