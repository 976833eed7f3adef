"""rosunit: runs a test case and writes its results as JUnit XML (ROS wiki, rosunit).

It may import rospkg.
"""

from __future__ import annotations

from rosz.ros1.rosunit import junitxml
from rosz.ros1.rosunit.junitxml import print_summary
from rosz.ros1.rosunit.runner import rosrun, unitrun
from rosz.ros1.rosunit.xmlrunner import XMLTestRunner

__all__ = ("XMLTestRunner", "junitxml", "print_summary", "rosrun", "unitrun")
