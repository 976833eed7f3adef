"""The exceptions of rospy; programs import them as ``rospy.exceptions``.

They do not lie in ``rosz.ros1.client.rospy``, since the modules below rospy raise them too (ROS
wiki, rospy/Overview/Exceptions).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

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
    """Base class of the errors that rospy raises for its users."""


class ROSSerializationException(ROSException):
    """A message has a value that does not fit its field."""


class ROSInitException(ROSException):
    """An operation needs a node, and ``init_node`` has not been called."""


class ROSInterruptException(ROSException, KeyboardInterrupt):
    """A sleep or wait ended because of the shutdown."""


class ROSTimeMovedBackwardsException(ROSInterruptException):
    """ROS time was set back during a sleep.

    Attributes:
        time: The change of ROS time in seconds; negative.
    """

    def __init__(self, time: float) -> None:
        self.time = time
        super().__init__("ROS time moved backwards")


class ROSInternalException(Exception):
    """An internal error; raised only by code written for rospy."""


class TransportException(ROSInternalException):
    """An error of a connection; raised only by code written for rospy."""


class TransportTerminated(TransportException):
    """The peer closed a connection; raised only by code written for rospy."""


class TransportInitError(TransportException):
    """A connection could not be made; raised only by code written for rospy."""


for _name in __all__:
    # Tracebacks and pickles use the name that programs import.
    globals()[_name].__module__ = "rospy.exceptions"


@contextmanager
def raised_as(kind: type[Exception], foreign: type[Exception]) -> Iterator[None]:
    """Raise errors of one class as those of another, with the same text."""
    try:
        yield
    except foreign as error:
        raise kind(str(error)) from error
