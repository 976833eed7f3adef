"""genpy.rostime: the classes of the fields ``time`` and ``duration``."""

from rosz.msgs.builtin_interfaces.msg import Duration, Time
from rosz.time import StampValue as TVal

__all__ = ("Duration", "TVal", "Time")
