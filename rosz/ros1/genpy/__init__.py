"""genpy: messages, times and durations as generated ROS 1 code knows them (ROS wiki, genpy).

``genpy.dynamic`` is not there: rosz compiles definitions through ``rosz.typestore``. ``serialize``
and ``deserialize`` of a message write and read CDR, which is what goes over rosz's wire, and not
ROS 1's layout.
"""

from rosz.ros1.genpy import message, rostime
from rosz.ros1.genpy.message import (
    DeserializationError,
    Message,
    MessageException,
    SerializationError,
)
from rosz.ros1.genpy.rostime import Duration, Time, TVal

__all__ = (
    "DeserializationError",
    "Duration",
    "Message",
    "MessageException",
    "SerializationError",
    "TVal",
    "Time",
    "message",
    "rostime",
)
