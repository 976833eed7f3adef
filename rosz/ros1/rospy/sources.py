"""What all publishers of one topic in a process share: one publisher of the node."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from rosz.errors import ClosedError, EncodeError
from rosz.node import Node, SubscriberLink
from rosz.node import Publisher as NodePublisher
from rosz.qos import QoS
from rosz.ros1.rospy.exceptions import ROSException, ROSSerializationException
from rosz.ros1.rospy.msg import AnyMsg, in_words_of_genpy
from rosz.ros1.rospy.state import is_shutdown, state, when_ready

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ("Source", "SubscribeListener", "acquire_source")


class SubscribeListener:
    """Told of the subscribers of a publisher as they come and go; to be inherited from."""

    def peer_subscribe(
        self,
        topic_name: str,
        topic_publish: Callable[..., None],
        peer_publish: Callable[..., None],
    ) -> None:
        """Take note of a new subscriber.

        Args:
            topic_name: Global name of the topic.
            topic_publish: Publishes to all subscribers.
            peer_publish: Publishes to the new one alone.
        """

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """Take note of a subscriber that went.

        Args:
            topic_name: Global name of the topic.
            num_peers: How many are left.
        """


class Source:
    """The one publisher of a topic in this process.

    Args:
        name: Global name of the topic.
        data_class: Class of its messages.
        queue_size: Of the first publisher.

    Attributes:
        seq: Messages published so far.
        latch: The last one, where the publisher latches.
        is_latch: Whether it does.
        closed: Whether it takes messages no more.
    """

    def __init__(self, name: str, data_class: type[Any], queue_size: int | None) -> None:
        self.name = self.resolved_name = name
        self.data_class = data_class
        self.type: str = data_class._type
        self.seq = 0
        self.latch: Any = None
        self.is_latch = False
        self.closed = False
        self._told = False
        self._has_header = bool(data_class._has_header)
        self._queue_size = queue_size if isinstance(queue_size, int) else 0
        self._lock = threading.RLock()
        self._members: list[object] = []
        self._listeners: list[SubscribeListener] = []
        self._peers: dict[SubscribeListener, int] = {}
        self._publisher: NodePublisher[Any] | None = None

    @property
    def ref_count(self) -> int:
        """How many publishers share this."""
        return len(self._members)

    def open(self, node: Node) -> None:
        """Begin to publish, now that there is a node."""
        with self._lock:
            if self.closed or self.data_class is AnyMsg:
                return
            before = self._publisher
            depth = self._queue_size
            if self.is_latch:
                qos = QoS(depth=1, durability="transient_local")
            else:
                qos = QoS(depth=depth) if depth > 0 else QoS(history="keep_all")
            self._publisher = NodePublisher(node, self.name, self.data_class, qos)
            node.keep(self._publisher)
            for listener in self._listeners:
                self._listen(self._publisher, listener)
        if before is not None:
            before.close()

    def make_latching(self) -> None:
        """Keep the last message for who comes later, from now on."""
        with self._lock:
            if self.is_latch:
                return
            self.is_latch = True
            opened = self._publisher is not None
        if opened and state.node is not None:
            self.open(state.node)

    def join(self, member: object, listener: SubscribeListener | None) -> None:
        """Count one more publisher in."""
        with self._lock:
            self._members.append(member)
            if listener is not None:
                self._listeners.append(listener)
                if self._publisher is not None:
                    self._listen(self._publisher, listener)

    def release(self, member: object) -> None:
        """Count a publisher out; the last one closes this."""
        with state.lock:
            self._members.remove(member)
            if self._members:
                return
            self.closed = True
            state.sources.pop((self.name, self.data_class), None)
        if self._publisher is not None:
            self._publisher.close()

    def publish(self, message: Any) -> None:
        """Send a message.

        Raises:
            ROSException: There is no node yet, or the topic is closed.
            ROSSerializationException: A field has a value that does not fit.
        """
        if self.data_class is AnyMsg:
            self._pass_on(message)
            return
        publisher = self._publisher
        if publisher is None:
            if is_shutdown():
                return
            raise ROSException(
                "ROS node has not been initialized yet. Please call init_node() first"
            )
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
            # A program that asks whether it is shut down, and then publishes, may be too late.
            if not is_shutdown():
                raise ROSException("publish() to a closed topic") from error

    def _pass_on(self, message: AnyMsg) -> None:
        """Send bytes as they came, on a topic of the type that the first ones had."""
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
                qos = QoS(depth=1, durability="transient_local") if self.is_latch else QoS()
                self._publisher = node.keep(NodePublisher(node, self.name, kind, qos))
        self._publisher.publish_raw(message._buff)  # noqa: SLF001

    def _refuse(self, publisher: NodePublisher[Any], error: EncodeError) -> None:
        """Raise over a message that cannot be sent; only tell, as in rospy, if nobody listens."""
        if publisher.subscribers():
            raise ROSSerializationException(str(error)) from error
        if not self._told:
            self._told = True
            publisher.node.log.warning(
                "a message on '%s' cannot be sent (told once; with a subscriber it is an"
                " exception): %s",
                self.name,
                error,
            )

    def get_num_connections(self) -> int:
        """Return how many subscribers there are."""
        publisher = self._publisher
        if publisher is None or publisher.closed:
            return 0
        return len(publisher.subscribers())

    def has_connections(self) -> bool:
        """Tell whether there is a subscriber."""
        return self.get_num_connections() > 0

    def _listen(self, publisher: NodePublisher[Any], listener: SubscribeListener) -> None:
        def connected(link: SubscriberLink[Any]) -> None:
            def to_it_alone(message: Any) -> None:
                link.publish(message)

            listener.peer_subscribe(self.name, self.publish, to_it_alone)

        def disconnected(_node: str) -> None:
            listener.peer_unsubscribe(self.name, self.get_num_connections())

        publisher.on_connection(connected, disconnected)


def acquire_source(
    name: str, data_class: type[Any], *, latch: bool, queue_size: int | None
) -> Source:
    """Return what publishes on a topic, made at the first asking."""
    with state.lock:
        source: Source | None = state.sources.get((name, data_class))
        made = source is None
        if source is None:
            source = state.sources[name, data_class] = Source(name, data_class, queue_size)
            source.is_latch = latch
    if made:
        when_ready(source.open)
    elif latch:
        source.make_latching()
    return source
