"""The exceptions of rospy, by its names (ROS wiki, rospy/Overview/Exceptions)."""

from __future__ import annotations

from rosz.ros1.rospy.absent import attribute

__all__ = (
    "ROSException",
    "ROSInitException",
    "ROSInternalException",
    "ROSInterruptException",
    "ROSSerializationException",
    "ROSTimeMovedBackwardsException",
    "TransportException",
    "TransportInitError",
    "TransportTerminated",
)


class ROSException(Exception):
    """Root of what rospy raises for its users to handle."""


class ROSSerializationException(ROSException):
    """A message has a value that does not fit its field."""


class ROSInitException(ROSException):
    """Something needs a node, and there is none."""


class ROSInterruptException(ROSException, KeyboardInterrupt):
    """A sleep or wait ended because of the shutdown."""


class ROSTimeMovedBackwardsException(ROSInterruptException):
    """ROS time was set back during a sleep.

    Attributes:
        time: By how many seconds, negative.
    """

    def __init__(self, time: float) -> None:
        self.time = time
        super().__init__("ROS time moved backwards")


class ROSInternalException(Exception):
    """A fault inside; nothing raises it but code written for rospy."""


class TransportException(ROSInternalException):
    """A fault of a connection; nothing raises it but code written for rospy."""


class TransportTerminated(TransportException):
    """The other side closed a connection; nothing raises it but code written for rospy."""


class TransportInitError(TransportException):
    """A connection could not be made; nothing raises it but code written for rospy."""


for _name in __all__:
    # Tracebacks and reprs show it as programs import it.
    globals()[_name].__module__ = "rospy.exceptions"

__getattr__ = attribute(__name__)
