"""rosunit: running unit tests that leave a result file (ROS wiki, rosunit)."""

from rosz.ros1.rosunit.run import rosrun, unitrun

__all__ = ("rosrun", "unitrun")
