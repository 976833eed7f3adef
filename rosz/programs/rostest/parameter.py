"""paramtest: a parameter is set."""

# ruff: noqa: PT009  # unittest is what rostest runs

from __future__ import annotations

import unittest

from rosz.programs.rostest.waiting import wait_until
from rosz.ros1 import rospy

__all__ = ("ParamTest",)

_WAIT_SECONDS = 20


class ParamTest(unittest.TestCase):
    """The parameter that ``~param_name_target`` names is set within ``~wait_time`` seconds."""

    def test_param(self) -> None:
        """The parameter is set, to ``~param_value_expected`` if that is given."""
        name = rospy.get_param("~param_name_target", "")
        self.assertTrue(name, "ParamTest not initialized properly: no ~param_name_target")
        wait_time = float(rospy.get_param("~wait_time", _WAIT_SECONDS))
        self.assertTrue(
            wait_until(lambda: rospy.has_param(name), wait_time),
            f"parameter [{name}] is not set within {wait_time:g} s",
        )
        expected = rospy.get_param("~param_value_expected", None)
        if expected:
            self.assertEqual(expected, rospy.get_param(name))
