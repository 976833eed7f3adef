"""rospy.topics: publishers and subscribers (ROS wiki, rospy/Overview/Publishers and Subscribers).

As in rospy, all publishers of one topic in a process share a publisher of the node, and all
subscribers share a subscription: `SharedPublisher` and `SharedSubscription`.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from typing import Any

from rosz.names import check
from rosz.ros1.client.rospy.core import warn_of_illegal_name
from rosz.ros1.client.rospy.msg import args_kwds_to_message
from rosz.ros1.client.rospy.names import resolve_name, resolve_name_without_node_name
from rosz.ros1.client.rospy.shared import (
    DEFAULT_BUFF_SIZE,
    NO_NODE,
    SharedPublisher,
    SharedSubscription,
    SubscribeListener,
)
from rosz.ros1.exceptions import ROSException
from rosz.ros1.state import has_node, state

__all__ = ("DEFAULT_BUFF_SIZE", "Publisher", "SubscribeListener", "Subscriber", "Topic")

_TAKEN = re.compile(r"(/[^/%*$#?\x00-\x1f\x7f]+)+")
_NO_QUEUE_SIZE = (
    "The publisher should be created with an explicit keyword argument 'queue_size'. Please see"
    " http://wiki.ros.org/rospy/Overview/Publishers%20and%20Subscribers for more information."
)


def _check(name: str) -> str:
    """Return a full name that ROS 1 takes, legal or not, or raise an InvalidName.

    Keys cannot hold all names: Zenoh and the tokens use ``%*$#?`` themselves.
    """
    return name if _TAKEN.fullmatch(name) else check(name)


class Topic:
    """Base class of publishers and subscribers.

    Args:
        name: Name of the topic.
        data_class: Message class.
        reg_type: ``pub`` or ``sub``.

    Attributes:
        name: Full name.
        resolved_name: The same.
        type: Type name, such as ``std_msgs/String``.
        md5sum: MD5 hash of the definition.

    Raises:
        ValueError: The name is invalid, or the class is not a message class.
    """

    def __init__(self, name: str, data_class: type[Any], reg_type: str) -> None:
        if not name or not isinstance(name, str):
            raise ValueError("topic name is not a non-empty string")
        if data_class is None:
            raise ValueError("topic parameter 'data_class' is not initialized")
        if not isinstance(data_class, type):
            raise ValueError(f"data_class [{data_class}] is not a class")  # noqa: TRY004  # rospy's
        if not hasattr(data_class, "_md5sum") or not hasattr(data_class, "_type"):
            raise ValueError(
                f"data_class [{type(data_class).__name__}] is not a message data class"
            )
        warn_of_illegal_name(name, 4)
        resolve = resolve_name if has_node() else resolve_name_without_node_name
        self.name: str = _check(resolve(name))
        self.resolved_name: Any = self.name
        self.type: Any = data_class._type
        self.data_class: Any = data_class
        self.md5sum: Any = data_class._md5sum
        self.reg_type = reg_type
        self.impl: Any = None

    def get_num_connections(self) -> int:
        """Return the number of subscribers of a publisher, or of publishers of a subscriber."""
        return int(self.impl.get_num_connections())

    def unregister(self) -> None:
        """Unregister from the topic; again is not an error. As in rospy, only the name stays."""
        impl, self.impl = self.impl, None
        if impl is not None:
            impl.leave()
            self.resolved_name = self.type = self.md5sum = self.data_class = None


class Publisher(Topic):
    """A publisher of a topic; errors are those of `Topic`.

    Args:
        name: As for `Topic`, as is ``data_class``.
        subscriber_listener: Object to notify of subscribers.
        tcp_nodelay: Ignored; small messages are never delayed.
        latch: Whether later subscribers receive the last message.
        headers: Kept in ``impl.headers``; connections do not have headers of their own.
        queue_size: Number of messages to keep for a slow subscriber; 0 for no limit.
    """

    impl: SharedPublisher | None

    def __init__(  # noqa: PLR0917  # rospy's signature
        self,
        name: str,
        data_class: type[Any],
        subscriber_listener: SubscribeListener | None = None,
        tcp_nodelay: bool = False,  # noqa: ARG002  # rospy's signature
        latch: bool = False,
        headers: dict[str, str] | None = None,
        queue_size: int | None = None,
    ) -> None:
        super().__init__(name, data_class, "pub")
        if queue_size is None:
            warnings.warn(_NO_QUEUE_SIZE, SyntaxWarning, stacklevel=2)
        self.impl = SharedPublisher.of((self.name, data_class), state.publishers, queue_size)
        if headers:
            self.impl.add_headers(headers)
        if subscriber_listener is not None:
            self.impl.add_subscriber_listener(subscriber_listener)
        if latch:
            self.impl.enable_latch()
        self.impl.start()

    def publish(self, *args: Any, **kwds: Any) -> None:
        """Publish a message.

        Args:
            args: A message, or the values of all its fields.
            kwds: Values of some of its fields by name.

        Raises:
            ROSException: There is no node yet, or the publisher is unregistered.
            ROSSerializationException: A value does not fit its field.
            TypeError: The arguments do not make a message of the topic.
            AttributeError: The message does not have such a field.
        """
        shared = self.impl
        if shared is None:
            raise ROSException("publish() to an unregistered() handle")
        if len(args) == 1 and not kwds and type(args[0]) is self.data_class:
            shared.publish(args[0])
            return
        if not has_node():
            raise ROSException(NO_NODE)
        shared.publish(args_kwds_to_message(self.data_class, args, kwds))


class Subscriber(Topic):
    """A subscriber of a topic.

    Args:
        name: Name of the topic.
        data_class: Message class; ``rospy.AnyMsg`` for messages of any type, not decoded.
        callback: Function called with each message, on the thread of the topic.
        callback_args: Second argument for the callback, if it is not None.
        queue_size: Number of the newest messages to keep; 10 000 when not given or 0.
        buff_size: Ignored; there is no such buffer.
        tcp_nodelay: Ignored; small messages are never delayed.

    Attributes:
        callback: The callback.
        callback_args: The second argument for the callback.

    Raises:
        ValueError: The name is invalid, or the class is not a message class.
        ROSException: A size is not a positive integer.
    """

    impl: SharedSubscription | None

    def __init__(  # noqa: PLR0917  # rospy's signature
        self,
        name: str,
        data_class: type[Any],
        callback: Callable[..., object] | None = None,
        callback_args: Any = None,
        queue_size: int | None = None,
        buff_size: int = DEFAULT_BUFF_SIZE,
        tcp_nodelay: bool = False,
    ) -> None:
        super().__init__(name, data_class, "sub")
        if queue_size is not None and not isinstance(queue_size, int):
            raise ROSException("queue size must be an integer")
        if not isinstance(buff_size, int) or buff_size <= 0:
            raise ROSException("buffer size must be a positive integer")
        self.callback = callback
        self.callback_args = None if callback is None else callback_args
        self.impl = SharedSubscription.of((self.name, data_class), state.subscriptions, queue_size)
        self.impl.configure(queue_size, buff_size, tcp_nodelay=tcp_nodelay)
        if callback is not None:
            self.impl.add_callback(callback, callback_args)
        self.impl.start()

    def unregister(self) -> None:
        """Unregister from the topic; again is not an error. As in rospy, only the name stays."""
        if self.impl is not None and self.callback is not None:
            self.impl.remove_callback(self.callback, self.callback_args)
        super().unregister()
