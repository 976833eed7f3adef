"""What messages come from, and who is told of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

__all__ = ("SimpleFilter", "Subscriber", "now", "stamp_of")


class SimpleFilter:
    """A source of messages for callbacks."""

    def __init__(self) -> None:
        self.callbacks: dict[int, tuple[Callable[..., Any], tuple[Any, ...]]] = {}

    def registerCallback(self, cb: Callable[..., Any], *args: Any) -> int:  # noqa: N802  # ROS 1's
        """Have a function called with the messages, and with some arguments behind them.

        Returns:
            Number of the registration.
        """
        number = len(self.callbacks)
        self.callbacks[number] = cb, args
        return number

    def signalMessage(self, *msg: Any) -> None:  # noqa: N802  # ROS 1's
        """Call all callbacks."""
        for callback, args in list(self.callbacks.values()):
            callback(*msg, *args)


class Subscriber(SimpleFilter):
    """A subscriber of a topic as a source; takes what ``rospy.Subscriber`` does.

    Attributes:
        sub: The ``rospy.Subscriber``.
        topic: Name of the topic as it was given.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__()
        from rosz.ros1 import rospy

        self.topic = args[0] if args else kwargs["name"]
        self.sub = rospy.Subscriber(*args, **(kwargs | {"callback": self.callback}))

    def callback(self, msg: Any) -> None:
        """Take a message in."""
        self.signalMessage(msg)

    def getTopic(self) -> str:  # noqa: N802  # ROS 1's
        """Return the name of the topic."""
        return str(self.topic)

    def __getattr__(self, key: str) -> Any:
        if key == "sub":  # asked for before there is one
            raise AttributeError(key)
        return getattr(self.sub, key)


def now() -> Any:
    """Return ROS time."""
    from rosz.ros1 import rospy

    return rospy.Time.now()


def stamp_of(msg: Any, allow_headerless: bool) -> Any:
    """Return when a message was stamped; now for one without a stamp, or None if that is no way."""
    header = getattr(msg, "header", None)
    stamp = getattr(header, "stamp", None)
    if stamp is not None:
        return stamp
    if allow_headerless:
        return now()
    from rosz.ros1 import rospy

    rospy.logwarn(
        "Cannot use message filters with non-stamped messages. Use the 'allow_headerless'"
        " constructor option to auto-assign ROS time to headerless messages."
    )
    return None
