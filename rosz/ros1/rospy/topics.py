"""rospy.topics: publishers and subscribers (ROS wiki, rospy/Overview/Publishers and Subscribers).

As in rospy, all publishers of one topic in a process share a publisher of the node, and all
subscribers share a subscription: `_SharedPublisher` and `_SharedSubscription`.
"""

from __future__ import annotations

import threading
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Self

from rosz.errors import ClosedError, EncodeError, RoszError, WaitTimeout
from rosz.message import Message
from rosz.names import check
from rosz.node import MessageInfo, Node, SubscriberLink, Subscription
from rosz.node import Publisher as NodePublisher
from rosz.qos import QoS
from rosz.ros1.exceptions import ROSException, ROSSerializationException
from rosz.ros1.rospy.core import warn_of_illegal_name
from rosz.ros1.rospy.msg import AnyMsg, args_kwds_to_message, in_words_of_genpy, to_ros1_log
from rosz.ros1.rospy.names import resolve_name, resolve_name_without_node_name
from rosz.ros1.state import context, has_node, is_shutdown, state, when_ready
from rosz.wire import Token, format_token, gid

__all__ = ("DEFAULT_BUFF_SIZE", "Publisher", "SubscribeListener", "Subscriber", "Topic")

DEFAULT_BUFF_SIZE = 65536
"""Default of a parameter that is ignored."""

_NO_QUEUE_SIZE = (
    "The publisher should be created with an explicit keyword argument 'queue_size'. Please see"
    " http://wiki.ros.org/rospy/Overview/Publishers%20and%20Subscribers for more information."
)

_NO_NODE = "ROS node has not been initialized yet. Please call init_node() first"

_Member = tuple[object, Callable[..., object] | None, Any]
_NO_LIMIT = 10_000
"""Queue size when none is given: more messages than TCP and a publisher's queue hold in rospy."""
_ORIGIN_TIMEOUT = 1.0
_HEADER = "_connection_header"
_LOGS = frozenset({"/rosout", "/rosout_agg"})
"""Topics of the log in ROS 1."""


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
        self.name = self.resolved_name = check(resolve(name))
        self.type: str = data_class._type
        self.data_class = data_class
        self.md5sum: str = data_class._md5sum
        self.reg_type = reg_type
        self.impl: Any = None

    def get_num_connections(self) -> int:
        """Return the number of subscribers of a publisher, or of publishers of a subscriber."""
        return int(self.impl.get_num_connections())

    def unregister(self) -> None:
        """Unregister from the topic; again is not an error."""
        impl, self.impl = self.impl, None
        if impl is not None:
            impl.remove(self)


class SubscribeListener:
    """Base class of objects that a publisher notifies of subscribers."""

    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable[..., None], peer_publish: Callable[..., None]
    ) -> None:
        """Handle a new subscriber.

        Args:
            topic_name: Full name of the topic.
            topic_publish: Function that publishes to all subscribers.
            peer_publish: Function that publishes to the new one only.
        """

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """Handle a subscriber that is gone.

        Args:
            topic_name: Full name of the topic.
            num_peers: Number of the remaining subscribers.
        """


class Publisher(Topic):
    """A publisher of a topic.

    Args:
        name: Name of the topic.
        data_class: Message class.
        subscriber_listener: Object to notify of subscribers.
        tcp_nodelay: Ignored; small messages are never delayed.
        latch: Whether later subscribers receive the last message.
        headers: Ignored; connections do not have headers of their own.
        queue_size: Number of messages to keep for a slow subscriber; 0 for no limit.

    Raises:
        ValueError: The name is invalid, or the class is not a message class.
    """

    impl: _SharedPublisher | None

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
        self.impl = _SharedPublisher.of(self, state.publishers, queue_size)
        self.impl.add(self, subscriber_listener, latch=latch)

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
            raise ROSException(_NO_NODE)
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

    impl: _SharedSubscription | None

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
        self.impl = _SharedSubscription.of(self, state.subscriptions, queue_size)
        self.impl.add(self, callback, callback_args)


class _Shared:
    """Base class of what the publishers, or the subscribers, of a topic and type share.

    It has the queue size of the first one, and is closed after the last one.
    """

    def __init__(self, name: str, data_class: type[Any], queue_size: int | None) -> None:
        self.name = self.resolved_name = name
        self.data_class = data_class
        self.type: str = data_class._type
        self.closed = False
        self._depth = queue_size if isinstance(queue_size, int) else 0
        self._lock = threading.RLock()

    @classmethod
    def of(
        cls, topic: Topic, known: dict[tuple[str, type[Any]], Any], queue_size: int | None
    ) -> Self:
        """Return the object of a topic and type, created on first use."""
        key = topic.resolved_name, topic.data_class
        with state.lock:
            if key not in known:
                known[key] = cls(*key, queue_size)
            shared: Self = known[key]
        return shared


class _SharedPublisher(_Shared):
    """The publisher of the node that all publishers of a topic share."""

    def __init__(self, name: str, data_class: type[Any], queue_size: int | None) -> None:
        super().__init__(name, data_class, queue_size)
        self.seq = 0
        self.latch: Any = None
        self.is_latch = False
        self._warned = False
        self._has_header = bool(data_class._has_header)
        self._members: list[object] = []
        self._listeners: list[SubscribeListener] = []
        self._publisher: NodePublisher[Any] | None = None

    @property
    def ref_count(self) -> int:
        """The number of publishers that share this one."""
        return len(self._members)

    def open(self, node: Node) -> None:
        """Create the publisher of the node."""
        with self._lock:
            if self.closed or self.data_class is AnyMsg:
                return
            before = self._publisher
            qos = QoS(depth=self._depth) if self._depth > 0 else QoS(history="keep_all")
            self._publisher = self._declare(node, self.data_class, qos)
            for listener in self._listeners:
                self._listen(self._publisher, listener)
        if before is not None:
            before.close()

    def _declare(self, node: Node, kind: type[Any], qos: QoS) -> NodePublisher[Any]:
        if self.is_latch:
            qos = QoS(depth=1, durability="transient_local")
        return node.keep(NodePublisher(node, self.name, kind, qos))

    def add(self, member: object, listener: SubscribeListener | None, *, latch: bool) -> None:
        """Add a publisher; the first one creates the publisher of the node.

        A later one that latches makes all of them latch from now on.
        """
        with self._lock:
            first = not self._members
            self._members.append(member)
            if listener is not None:
                self._listeners.append(listener)
                if self._publisher is not None:
                    self._listen(self._publisher, listener)
            reopen = latch and not self.is_latch and self._publisher is not None
            self.is_latch = self.is_latch or latch
        if first:
            when_ready(self.open)
        elif reopen and state.node is not None:
            self.open(state.node)

    def remove(self, member: object) -> None:
        """Remove a publisher; close this one after the last."""
        with state.lock:
            self._members.remove(member)
            if self._members:
                return
            self.closed = True
            state.publishers.pop((self.name, self.data_class), None)
        if self._publisher is not None:
            self._publisher.close()

    def publish(self, message: Any) -> None:
        """Publish a message.

        Raises:
            ROSException: There is no node yet, or the topic is closed.
            ROSSerializationException: A value does not fit its field.
        """
        if self.data_class is AnyMsg:
            self._publish_any(message)
            return
        publisher = self._publisher
        if publisher is None:
            if is_shutdown():
                return
            raise ROSException(_NO_NODE)
        try:
            if self._has_header:
                with self._lock:
                    self.seq += 1
                    message.header.seq = self.seq
            if self.is_latch:
                self.latch = message
            publisher.publish(message)
        except EncodeError as error:
            self._refuse(publisher, in_words_of_genpy(message, error))
        except ClosedError as error:
            # The shutdown may have begun after the program checked for it.
            if not is_shutdown():
                raise ROSException("publish() to a closed topic") from error

    def _publish_any(self, message: AnyMsg) -> None:
        """Publish bytes unchanged; the topic gets the type of the first message."""
        node = state.node
        if node is None or is_shutdown():
            return
        with self._lock:
            if self._publisher is None:
                origin = message._connection_header  # noqa: SLF001  # rospy's name for it
                if "type" not in origin:
                    raise ROSException(
                        f"cannot publish on '{self.name}': its type is not known before a message"
                        " that a subscriber with rospy.AnyMsg received is published"
                    )
                package, _, name = origin["type"].partition("/")
                kind: Any = node.context.types.message(f"{package}/msg/{name}")
                self._publisher = self._declare(node, kind, QoS())
        self._publisher.publish_raw(message.payload(self._publisher.message_type))

    def _refuse(self, publisher: NodePublisher[Any], error: EncodeError) -> None:
        """Raise an error for an invalid message; without subscribers only log it, as in rospy."""
        if publisher.subscribers():
            raise ROSSerializationException(str(error)) from error
        if not self._warned:
            self._warned = True
            publisher.node.log.warning(
                "a message on '%s' cannot be published (logged once; with a subscriber it is an"
                " exception): %s",
                self.name,
                error,
            )

    def get_num_connections(self) -> int:
        """Return the number of subscribers."""
        publisher = self._publisher
        if publisher is None or publisher.closed:
            return 0
        return len(publisher.subscribers())

    def has_connections(self) -> bool:
        """Return whether there are subscribers."""
        return self.get_num_connections() > 0

    def _listen(self, publisher: NodePublisher[Any], listener: SubscribeListener) -> None:
        def connected(link: SubscriberLink[Any]) -> None:
            listener.peer_subscribe(self.name, self.publish, link.publish)

        def disconnected(_node: str) -> None:
            listener.peer_unsubscribe(self.name, self.get_num_connections())

        publisher.on_connection(connected, disconnected)


class _SharedSubscription(_Shared):
    """The subscription of the node that all subscribers of a topic and type share."""

    def __init__(self, name: str, data_class: type[Any], queue_size: int | None) -> None:
        super().__init__(name, data_class, queue_size)
        self.queue_size = queue_size
        self._members: tuple[_Member, ...] = ()
        self._subscription: Subscription[Any] | None = None
        self._origins: dict[bytes, Token] = {}
        self._latched: dict[bytes, tuple[Any, MessageInfo]] = {}

    def open(self, node: Node) -> None:
        """Create the subscription of the node."""
        with self._lock:
            if self.closed:
                return
            limited = self._depth > 0
            qos = QoS(depth=self._depth if limited else _NO_LIMIT)
            name = self.name
            receive: Callable[[Any, MessageInfo], None] = self._receive
            kind: type[Any] | None = self.data_class
            raw = kind is AnyMsg
            if raw:
                kind, receive = None, self._receive_any
            elif name in _LOGS and self.type == "rosgraph_msgs/Log":
                from rosz.msgs.rcl_interfaces.msg import Log as Ros2Log

                name, kind, receive = "/rosout", Ros2Log, self._receive_log
            self._subscription = node.keep(
                Subscription(
                    node,
                    name,
                    kind,
                    receive,
                    qos,
                    raw=raw,
                    with_info=True,
                    # As in rospy, what a queue_size does not hold is dropped silently.
                    warn_dropped=not limited,
                )
            )

    def add(
        self, member: object, callback: Callable[..., object] | None, callback_args: Any
    ) -> None:
        """Add a subscriber; the first one creates the subscription.

        A later one receives the latched messages that the others have received.
        """
        with self._lock:
            first = not self._members
            newcomer = (member, callback, callback_args)
            self._members = (*self._members, newcomer)
        if first:
            when_ready(self.open)
            return
        self._update_publishers()
        missed = list(self._latched.values())
        for message, info in missed:
            self._deliver(message, info, (newcomer,))

    def remove(self, member: object) -> None:
        """Remove a subscriber; close the subscription after the last."""
        with state.lock:
            self._members = tuple(one for one in self._members if one[0] is not member)
            if self._members:
                return
            self.closed = True
            state.subscriptions.pop((self.name, self.data_class), None)
        if self._subscription is not None:
            self._subscription.close()

    def get_num_connections(self) -> int:
        """Return the number of publishers."""
        subscription = self._subscription
        if subscription is None or subscription.closed:
            return 0
        return len(subscription.publishers())

    def connection_header(self, info: MessageInfo, timeout: float = 0.0) -> dict[str, str]:
        """Return the connection header of a message, in the terms of rospy.

        Args:
            info: Information about the message.
            timeout: Seconds to wait for the token of the publisher, which a message may precede.
        """
        origin = self._origin(info.gid)
        if origin is None and timeout:
            with suppress(WaitTimeout, ClosedError):
                context().graph.wait_for(
                    lambda _: self._origin(info.gid) is not None, timeout, "the publisher"
                )
            origin = self._origin(info.gid)
        latching = origin is not None and origin.qos is not None and origin.qos.latched
        header = {
            "callerid": origin.node_name if origin else "",
            "latching": "1" if latching else "0",
            "topic": self.name,
            "type": info.type_name.replace("/msg/", "/"),
        }
        kind: Any = self.data_class
        if kind is AnyMsg:
            try:
                kind = context().types.message(info.type_name)
            except RoszError:  # AnyMsg needs no definition
                return header | {"md5sum": AnyMsg._md5sum, "message_definition": ""}
        return header | {"md5sum": kind._md5sum, "message_definition": kind._full_text}

    def _origin(self, publisher: bytes) -> Token | None:
        """Return the token of a publisher, or None if it is not known yet."""
        found = self._origins.get(publisher)
        if found is None:
            self._update_publishers()
            found = self._origins.get(publisher)
        return found

    def _update_publishers(self) -> None:
        """Read the publishers from the graph; drop the latched messages of those that are gone."""
        subscription = self._subscription
        tokens = subscription.publishers() if subscription is not None else []
        self._origins = origins = {gid(format_token(token)): token for token in tokens}
        with self._lock:
            self._latched = {one: kept for one, kept in self._latched.items() if one in origins}

    def _receive(self, message: Any, info: MessageInfo) -> None:
        origin = self._origins.get(info.gid) or self._origin(info.gid)
        if origin is not None and origin.qos is not None and origin.qos.latched:
            with self._lock:
                self._latched[info.gid] = (message, info)
                members = self._members
        else:
            members = self._members
        self._deliver(message, info, members)

    def _receive_log(self, message: Any, info: MessageInfo) -> None:
        self._receive(to_ros1_log(message), info)

    def _receive_any(self, payload: bytes, info: MessageInfo) -> None:
        header = self.connection_header(info)
        self._receive(AnyMsg.received(payload, header, context().types.message), info)

    def _deliver(self, message: Any, info: MessageInfo, members: tuple[_Member, ...]) -> None:
        state.local.delivery = (message, self, info)
        for _, callback, extra in members:
            if callback is not None:
                self._call(callback, message, extra)

    def _call(self, callback: Callable[..., object], message: Any, extra: Any) -> None:
        try:
            if extra is None:
                callback(message)
            else:
                callback(message, extra)
        except Exception as error:  # noqa: BLE001  # the callback boundary
            if state.node is not None and not is_shutdown():
                trace = error.__traceback__
                # Without the frames that called the callback.
                lines = traceback.format_exception(error.with_traceback(trace and trace.tb_next))
                state.node.log.error("bad callback: %s\n%s", callback, "".join(lines))


def _connection_header(message: Message) -> dict[str, str]:
    """Return the connection header of the message that this thread delivers."""
    delivery = getattr(state.local, "delivery", None)
    if delivery is None or delivery[0] is not message:
        raise AttributeError(
            f"'{type(message).__name__}' has its {_HEADER} only in the callback it is passed to"
        )
    header: dict[str, str] = delivery[1].connection_header(delivery[2], _ORIGIN_TIMEOUT)
    return header


# rospy sets the attribute on each message; here it is computed when it is read.
setattr(Message, _HEADER, property(_connection_header))
