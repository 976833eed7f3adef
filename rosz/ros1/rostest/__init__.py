"""rostest: tests that are nodes (ROS wiki, rostest).

What starts ``.test`` files is ``rosz launch``'s business and not here.
"""

from rosz.ros1.rostest.node import is_publisher, is_subscriber, rosrun, run, unitrun

__all__ = ("is_publisher", "is_subscriber", "rosrun", "run", "unitrun")
