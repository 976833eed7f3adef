"""advertisetest: topics have publishers, and services have servers."""

# ruff: noqa: PT009  # unittest is what rostest runs

from __future__ import annotations

import time
import unittest
from collections.abc import Callable, Mapping

from rosz.programs.rostest.waiting import Expected, expectations, wait_until
from rosz.ros1 import rospy, rosservice

__all__ = ("AdvertiseTest",)


class AdvertiseTest(unittest.TestCase):
    """What the parameters ``~topics`` and ``~services`` list is advertised, or is not."""

    def setUp(self) -> None:
        """Read the parameters."""
        self.topics = expectations("~topics")
        self.services = expectations("~services")
        if not self.topics and not self.services:
            self.fail("No topic or service is specified in rosparam.")

    def test_advertise_topics(self) -> None:
        """Topics have publishers."""
        self._check("Topic", self.topics, lambda: dict(rospy.get_published_topics()))

    def test_advertise_services(self) -> None:
        """Services have servers."""

        def types() -> dict[str, str | None]:
            names = {one.name for one in self.services} & {*rosservice.get_service_list()}
            return {name: rosservice.get_service_type(name) for name in names}

        self._check("Service", self.services, types)

    def _check(
        self, kind: str, expected: list[Expected], types: Callable[[], Mapping[str, str | None]]
    ) -> None:
        began = time.monotonic()
        for one in sorted(expected, key=lambda each: each.timeout):
            left = one.timeout - (time.monotonic() - began)
            name = one.name
            came = wait_until(lambda: name in types(), left)  # noqa: B023  # called in the loop
            what = "is" if one.negative else "is not"
            self.assertNotEqual(came, one.negative, f"{kind} [{one.name}] {what} advertised")
            if came and one.type is not None:
                self.assertEqual(one.type, types().get(one.name), f"{kind} type of [{one.name}]")
