"""message_filters: callbacks for messages that belong together (ROS wiki, message_filters)."""

from rosz.ros1.message_filters.cache import Cache
from rosz.ros1.message_filters.filters import SimpleFilter, Subscriber
from rosz.ros1.message_filters.synchronizers import (
    ApproximateTimeSynchronizer,
    TimeSynchronizer,
)

__all__ = (
    "ApproximateTimeSynchronizer",
    "Cache",
    "SimpleFilter",
    "Subscriber",
    "TimeSynchronizer",
)
