"""rostest: the test programs of ROS 1's package rostest.

May import everything below the command line.
"""

from rosz.programs.rostest.advertised import AdvertiseTest
from rosz.programs.rostest.parameter import ParamTest
from rosz.programs.rostest.published import PublishTest
from rosz.programs.rostest.rate import HzTest

__all__ = ("AdvertiseTest", "HzTest", "ParamTest", "PublishTest")
