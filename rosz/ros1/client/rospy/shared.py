"""The state that the publishers, or subscribers, of one topic in a process share, as in rospy.

It is the ``impl`` of a `rospy.Publisher` or `rospy.Subscriber`, with the names that rospy's has.
"""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Self

from rosz.errors import ClosedError, EncodeError, RoszError, WaitTimeout
from rosz.graph import View
from rosz.message import Message
from rosz.node import MessageInfo, Node, SubscriberLink, Subscription
from rosz.node import Publisher as NodePublisher
from rosz.qos import QoS
from rosz.ros1.client.rospy.msg import AnyMsg, in_words_of_genpy, to_ros1_log
from rosz.ros1.exceptions import ROSException, ROSSerializationException
from rosz.ros1.state import context, is_shutdown, state, when_ready
from rosz.wire import Kind, Token, format_token, gid

if TYPE_CHECKING:
    from rosz.ros1.client.rospy.statistics import Statistics

DEFAULT_BUFF_SIZE = 65536
"""Default of a parameter that is ignored."""

NO_NODE = "ROS node has not been initialized yet. Please call init_node() first"

_Callback = tuple[Callable[..., object], Any]
_NO_LIMIT = 10_000
"""Queue size when none is given: more messages than TCP and a publisher's queue hold in rospy."""
_ORIGIN_TIMEOUT = 1.0
_HEADER = "_connection_header"
_STATISTICS = "/statistics"
_NOT_MEASURED = frozenset({"/clock", _STATISTICS})
_LOGS = frozenset({"/rosout", "/rosout_agg"})
"""Topics of the log in ROS 1."""


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


class _Shared:
    """Base class of the state that publishers, or subscribers, of a topic and type share.

    It has the queue size of the first one, and is closed after the last one.
    """

    def __init__(self, name: str, data_class: type[Any], queue_size: int | None) -> None:
        self.name = self.resolved_name = name
        self.data_class = data_class
        self.type: str = data_class._type
        self.queue_size = queue_size
        self.closed = False
        self.ref_count = 0
        self._depth = queue_size if isinstance(queue_size, int) else 0
        self._lock = threading.RLock()
        self._started = False

    @classmethod
    def of(
        cls,
        key: tuple[str, type[Any]],
        registry: dict[tuple[str, type[Any]], Any],
        queue_size: int | None,
    ) -> Self:
        """Return the object of a topic and type, created on first use, for one more to share."""
        with state.lock:
            if key not in registry:
                registry[key] = cls(*key, queue_size)
            shared: Self = registry[key]
            shared.ref_count += 1
        return shared

    def start(self) -> None:
        """Take part in the topic, from ``init_node`` on."""
        with self._lock:
            started, self._started = self._started, True
        if not started:
            when_ready(self.open)

    def open(self, node: Node) -> None:
        """Create the publisher or the subscription of the node."""
        raise NotImplementedError(node.name)

    def _leave(self, registry: dict[tuple[str, type[Any]], Any]) -> bool:
        """Count one less that shares it; return whether it was the last one."""
        with state.lock:
            self.ref_count -= 1
            if self.ref_count > 0:
                return False
            self.closed = True
            registry.pop((self.name, self.data_class), None)
        return True

    def _peers(self) -> list[Token]:
        """Return the endpoints at the other end."""
        raise NotImplementedError(self.name)

    def get_num_connections(self) -> int:
        """Return the number of subscribers of a publisher, or of publishers of a subscriber."""
        return len(self._peers())

    def has_connections(self) -> bool:
        """Return whether there is anyone at the other end."""
        return bool(self._peers())

    def has_connection(self, endpoint_id: str) -> bool:
        """Return whether a node of a full name is at the other end."""
        return any(token.node_name == endpoint_id for token in self._peers())


class SharedPublisher(_Shared):
    """The publisher of the node that all publishers of a topic share.

    Attributes:
        subscriber_listeners: Objects that are notified of subscribers.
        headers: Headers that the publishers gave; nothing sends them.
        is_latch: Whether later subscribers receive the last message.
        latch: The last message, if ``is_latch``.
    """

    def __init__(self, name: str, data_class: type[Any], queue_size: int | None) -> None:
        super().__init__(name, data_class, queue_size)
        self.seq = 0
        self.latch: Any = None
        self.is_latch = False
        self.headers: dict[str, str] = {}
        self.subscriber_listeners: list[SubscribeListener] = []
        self._turn = threading.RLock()
        self._warned = False
        self._has_header = bool(data_class._has_header)
        self._publisher: NodePublisher[Any] | None = None

    def open(self, node: Node) -> None:
        """Create the publisher of the node."""
        with self._lock:
            if self.closed or self.data_class is AnyMsg:
                return
            before = self._publisher
            qos = QoS(depth=self._depth) if self._depth > 0 else QoS(history="keep_all")
            self._publisher = self._declare(node, self.data_class, qos)
            for listener in self.subscriber_listeners:
                self._listen(self._publisher, listener)
        if before is not None:
            before.close()

    def _declare(self, node: Node, kind: type[Any], qos: QoS) -> NodePublisher[Any]:
        if self.is_latch:
            qos = QoS(depth=1, durability="transient_local")
        local = node.context.local_delivery
        copies = local is not None and not local.by_reference  # programs of rospy change messages
        return node.keep(NodePublisher(node, self.name, kind, qos, copies=copies))

    def add_subscriber_listener(self, l: SubscribeListener) -> None:  # noqa: E741  # rospy's
        """Notify an object of subscribers, beginning with those that exist."""
        with self._lock:
            self.subscriber_listeners.append(l)
            if self._publisher is not None:
                self._listen(self._publisher, l)

    def add_headers(self, headers: dict[str, str]) -> None:
        """Add headers."""
        self.headers.update(headers)

    def enable_latch(self) -> None:
        """Latch from now on."""
        with self._lock:
            reopen = not self.is_latch and self._publisher is not None
            self.is_latch = True
        if reopen and state.node is not None:
            self.open(state.node)

    def set_queue_size(self, queue_size: int | None) -> None:
        """Set the attribute; the publisher keeps the queue size of the first one."""
        self.queue_size = queue_size

    def acquire(self) -> None:
        """Keep other threads that call this from publishing."""
        self._turn.acquire()

    def release(self) -> None:
        """Let other threads publish."""
        self._turn.release()

    def leave(self) -> None:
        """Share it no longer; the last one closes it."""
        if self._leave(state.publishers) and self._publisher is not None:
            self._publisher.close()

    def publish(self, message: Any, connection_override: SubscriberLink[Any] | None = None) -> None:
        """Publish a message, to one subscriber or to all; after the shutdown, drop it.

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
            raise ROSException(NO_NODE)
        if connection_override is not None:
            connection_override.publish(message)
            return
        try:
            if self._has_header or self.is_latch:
                self._prepare(message)
            publisher.publish(message)
        except EncodeError as error:
            if not is_shutdown():
                self._refuse(publisher, in_words_of_genpy(message, error))
        except ClosedError as error:
            # The shutdown may have begun after the program checked for it.
            if not is_shutdown():
                raise ROSException("publish() to a closed topic") from error

    def _prepare(self, message: Any) -> None:
        """Number a message with a header, and keep a latched one."""
        if self._has_header:
            with self._lock:
                self.seq += 1
                message.header.seq = self.seq
        if self.is_latch:
            self.latch = message

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

    def _peers(self) -> list[Token]:
        publisher = self._publisher
        return [] if publisher is None or publisher.closed else publisher.subscribers()

    def _listen(self, publisher: NodePublisher[Any], listener: SubscribeListener) -> None:
        def connected(link: SubscriberLink[Any]) -> None:
            if listener in self.subscriber_listeners:
                listener.peer_subscribe(self.name, self.publish, link.publish)

        def disconnected(_node: str) -> None:
            if listener in self.subscriber_listeners:
                listener.peer_unsubscribe(self.name, self.get_num_connections())

        publisher.on_connection(connected, disconnected)


class SharedSubscription(_Shared):
    """The subscription of the node that all subscribers of a topic and type share.

    Attributes:
        callbacks: The callbacks, each with its second argument or None.
        buff_size: Size of a buffer that there is not.
        tcp_nodelay: Whether small messages must not be delayed, which they never are.
    """

    def __init__(self, name: str, data_class: type[Any], queue_size: int | None) -> None:
        super().__init__(name, data_class, queue_size)
        self.callbacks: list[_Callback] = []
        self.buff_size = DEFAULT_BUFF_SIZE
        self.tcp_nodelay = False
        self._subscription: Subscription[Any] | None = None
        self._origins: dict[bytes, Token] = {}
        self._latched: dict[bytes, tuple[Any, MessageInfo]] = {}
        self._view: View | None = None
        self._topics: dict[str, set[str]] = {}
        self._statistics: Statistics | None = None
        self._reports: SharedPublisher | None = None

    def configure(self, queue_size: int | None, buff_size: int, *, tcp_nodelay: bool) -> None:
        """Set the attributes that a subscriber gives; the first queue size counts."""
        if queue_size is not None:
            self.queue_size = queue_size
        if buff_size != DEFAULT_BUFF_SIZE:
            self.buff_size = buff_size
        self.tcp_nodelay = self.tcp_nodelay or tcp_nodelay

    def open(self, node: Node) -> None:
        """Create the subscription of the node."""
        with self._lock:
            if self.closed:
                return
            self._measure(node)
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
                    # As in rospy, messages beyond queue_size are dropped silently.
                    warn_dropped=not limited,
                )
            )

    def _measure(self, node: Node) -> None:
        """Measure the topic if ``/enable_statistics`` is true."""
        if self.name in _NOT_MEASURED or not node.params.get("/enable_statistics", False):
            return
        from rosz.msgs.rosgraph_msgs.msg import TopicStatistics
        from rosz.ros1.client.rospy.statistics import Statistics

        key = _STATISTICS, TopicStatistics
        self._reports = SharedPublisher.of(key, state.publishers, 10)
        self._reports.start()
        self._statistics = Statistics(self.name, node.name, node.params, self._reports.publish)

    def add_callback(self, cb: Callable[..., object], cb_args: Any) -> None:
        """Call a function with each message, and with ``cb_args`` if not None.

        It receives the latched messages that the others have received.

        Raises:
            ROSException: The last subscriber is unregistered.
        """
        if self.closed:
            raise ROSException(f"subscriber [{self.name}] has been closed")
        with self._lock:
            self.callbacks = [*self.callbacks, (cb, cb_args)]
        self._update_publishers()
        for message, info in list(self._latched.values()):
            self._deliver(message, info, [(cb, cb_args)])

    def remove_callback(self, cb: Callable[..., object], cb_args: Any) -> None:
        """Call a function no longer.

        Raises:
            KeyError: It is not a callback with that argument.
        """
        if self.closed:
            return
        with self._lock:
            if (cb, cb_args) not in self.callbacks:
                raise KeyError("no matching cb")
            left = self.callbacks[:]
            left.remove((cb, cb_args))
            self.callbacks = left

    def leave(self) -> None:
        """Share it no longer; the last one closes it."""
        if self._leave(state.subscriptions) and self._subscription is not None:
            self._subscription.close()
            if self._reports is not None:
                self._reports.leave()

    def _peers(self) -> list[Token]:
        subscription = self._subscription
        return [] if subscription is None or subscription.closed else subscription.publishers()

    def connection_header(self, info: MessageInfo, timeout: float = 0.0) -> dict[str, str]:
        """Return the connection header of a message, in the terms of rospy.

        A message may precede the token of its publisher, which is waited for up to ``timeout``
        seconds.
        """
        origin = self._origin(info.gid)
        subscription = self._subscription
        if origin is None and timeout and subscription is not None:
            with suppress(WaitTimeout, ClosedError):
                subscription.others.wait_for(
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
        token = self._origins.get(publisher)
        if token is None:
            self._update_publishers()
            token = self._origins.get(publisher)
        return token

    def _update_publishers(self) -> None:
        """Read the publishers from the graph; drop the latched messages of those that are gone."""
        subscription = self._subscription
        tokens = subscription.publishers() if subscription is not None else []
        self._origins = origins = {gid(format_token(token)): token for token in tokens}
        with self._lock:
            self._latched = {
                publisher: kept for publisher, kept in self._latched.items() if publisher in origins
            }

    def _receive(self, message: Any, info: MessageInfo) -> None:
        origin = self._origins.get(info.gid) or self._origin(info.gid)
        if self._statistics is not None and origin is not None:
            now = context().clock.now()
            self._statistics.record(message, info, origin.node_name, now)
        if origin is not None and origin.qos is not None and origin.qos.latched:
            with self._lock:
                self._latched[info.gid] = (message, info)
                callbacks = self.callbacks
        else:
            callbacks = self.callbacks
        self._deliver(message, info, callbacks)

    def _receive_log(self, message: Any, info: MessageInfo) -> None:
        self._receive(to_ros1_log(message, self._topics_of), info)

    def _topics_of(self, node: str) -> list[str]:
        view = context().graph.view()
        if view is not self._view:
            self._view, self._topics = view, {}
            for token in view.entities(Kind.PUBLISHER, Kind.SUBSCRIPTION):
                self._topics.setdefault(token.node_name, set()).add(token.name)
        return sorted(self._topics.get(node, ()))

    def _receive_any(self, payload: bytes, info: MessageInfo) -> None:
        header = self.connection_header(info)
        self._receive(AnyMsg.received(payload, header, context().types.message), info)

    def _deliver(self, message: Any, info: MessageInfo, callbacks: list[_Callback]) -> None:
        state.local.delivery = (message, self, info)
        for callback, extra in callbacks:
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
