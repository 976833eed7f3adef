"""Publishers and subscribers by rospy's names.

ROS wiki, rospy/Overview/Publishers and Subscribers.

As in rospy all publishers of one topic in a process are one to the outside, and so are all its
subscribers: `Source` and `Sink` are what they share.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

from rosz.names import check, is_valid
from rosz.ros1.rospy.absent import attribute
from rosz.ros1.rospy.exceptions import ROSException
from rosz.ros1.rospy.msg import args_kwds_to_message
from rosz.ros1.rospy.names import resolve_name, resolve_name_without_node_name
from rosz.ros1.rospy.sinks import Sink, acquire_sink
from rosz.ros1.rospy.sources import Source, SubscribeListener, acquire_source
from rosz.ros1.rospy.state import has_node

__all__ = ("DEFAULT_BUFF_SIZE", "Publisher", "SubscribeListener", "Subscriber", "Topic")

DEFAULT_BUFF_SIZE = 65536
"""Accepted, and without meaning here: no buffer has to be large enough for a message."""

_NO_QUEUE_SIZE = (
    "The publisher should be created with an explicit keyword argument 'queue_size'. Please see"
    " http://wiki.ros.org/rospy/Overview/Publishers%20and%20Subscribers for more information."
)


class Topic:
    """What publishers and subscribers have in common.

    Args:
        name: Name of the topic.
        data_class: Class of its messages.
        reg_type: ``pub`` or ``sub``.

    Attributes:
        name: The global name.
        resolved_name: The same.
        type: ``pkg/Name``.
        md5sum: Hash of its definition, as in ROS 1.

    Raises:
        ValueError: The name is none that anything can have, or the class is none of a message.
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
        if not is_valid(name):
            warnings.warn(
                f"'{name}' is not a legal ROS graph resource name. This may cause problems with"
                " other ROS tools",
                stacklevel=4,
            )
        resolve = resolve_name if has_node() else resolve_name_without_node_name
        self.name = self.resolved_name = check(resolve(name))
        self.type: str = data_class._type
        self.data_class = data_class
        self.md5sum: str = data_class._md5sum
        self.reg_type = reg_type
        self.impl: Any = None

    def get_num_connections(self) -> int:
        """Return how many publishers or subscribers there are on the other side."""
        return int(self.impl.get_num_connections())

    def unregister(self) -> None:
        """Take no part in the topic any more; again is no error."""
        impl, self.impl = self.impl, None
        if impl is not None:
            impl.release(self)


class Publisher(Topic):
    """A source of messages on a topic.

    Args:
        name: Name of the topic.
        data_class: Class of its messages.
        subscriber_listener: Told of subscribers as they come and go.
        tcp_nodelay: Accepted; small messages never wait here.
        latch: Whether who subscribes later gets the last message.
        headers: Accepted; connections here have no headers of their own.
        queue_size: Messages kept while a subscriber is slow; 0 for no limit.

    Raises:
        ValueError: The name is none, or the class is none of a message.
    """

    impl: Source | None

    def __init__(  # noqa: PLR0917  # rospy's signature
        self,
        name: str,
        data_class: type[Any],
        subscriber_listener: SubscribeListener | None = None,
        tcp_nodelay: bool = False,  # noqa: ARG002  # rospy's signature
        latch: bool = False,
        headers: dict[str, str] | None = None,  # noqa: ARG002
        queue_size: int | None = None,
    ) -> None:
        super().__init__(name, data_class, "pub")
        if queue_size is None:
            warnings.warn(_NO_QUEUE_SIZE, SyntaxWarning, stacklevel=2)
        self.impl = acquire_source(
            self.resolved_name, data_class, latch=latch, queue_size=queue_size
        )
        self.impl.join(self, subscriber_listener)

    def publish(self, *args: Any, **kwds: Any) -> None:
        """Send a message: one of the topic's type, or the values of its fields.

        Raises:
            ROSException: There is no node yet, or the publisher is unregistered.
            ROSSerializationException: A field has a value that does not fit.
            TypeError: The arguments are no message of the topic.
            AttributeError: A keyword is no field of the message.
        """
        source = self.impl
        if source is None:
            raise ROSException("publish() to an unregistered() handle")
        if len(args) == 1 and not kwds and type(args[0]) is self.data_class:
            source.publish(args[0])
            return
        if not has_node():
            raise ROSException(
                "ROS node has not been initialized yet. Please call init_node() first"
            )
        source.publish(args_kwds_to_message(self.data_class, args, kwds))


class Subscriber(Topic):
    """A sink of messages of a topic.

    Args:
        name: Name of the topic.
        data_class: Class of its messages; ``rospy.AnyMsg`` for whatever comes.
        callback: Gets each message, on a thread of the topic, one at a time.
        callback_args: A second argument for the callback, if it is not None.
        queue_size: The newest so many messages wait for their turn; 10 000 when not given, or 0.
        buff_size: Accepted; no buffer has to be large enough for a message here.
        tcp_nodelay: Accepted; small messages never wait here.

    Attributes:
        callback: As given.
        callback_args: As given.

    Raises:
        ValueError: The name is none, or the class is none of a message.
        ROSException: A size is no positive whole number.
    """

    impl: Sink | None

    def __init__(  # noqa: PLR0917  # rospy's signature
        self,
        name: str,
        data_class: type[Any],
        callback: Callable[..., object] | None = None,
        callback_args: Any = None,
        queue_size: int | None = None,
        buff_size: int = DEFAULT_BUFF_SIZE,
        tcp_nodelay: bool = False,  # noqa: ARG002  # rospy's signature
    ) -> None:
        super().__init__(name, data_class, "sub")
        if queue_size is not None and not isinstance(queue_size, int):
            raise ROSException("queue size must be an integer")
        if not isinstance(buff_size, int) or buff_size <= 0:
            raise ROSException("buffer size must be a positive integer")
        self.callback = callback
        self.callback_args = callback_args
        self.impl = acquire_sink(self.resolved_name, data_class, queue_size)
        self.impl.join(self, callback, callback_args)


__getattr__ = attribute(__name__)
