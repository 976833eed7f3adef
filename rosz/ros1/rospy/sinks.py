"""What all subscribers of one topic and type in a process share: one subscription, one thread."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable
from typing import Any

from rosz.errors import RoszError
from rosz.message import Message
from rosz.node import GenericSubscription, MessageInfo, Node, Subscription
from rosz.qos import QoS
from rosz.ros1.rospy.msg import AnyMsg
from rosz.ros1.rospy.state import context, is_shutdown, state, when_ready
from rosz.wire import Token, format_token, gid

__all__ = ("Sink", "acquire_sink")

_Member = tuple[object, Callable[..., object] | None, Any]
_NO_LIMIT = 10_000
"""Messages that wait for a callback at most where no limit is given: more than TCP and the queue of
a publisher hold in rospy, and in Zenoh's own queue, which is many times as fast as one in Python.
"""
_HEADER = "_connection_header"
_LOGS = frozenset({"/rosout", "/rosout_agg"})
"""Where programs listen to the log; nobody gathers the second from the first here."""


class Sink:
    """The one subscription of a topic in this process.

    Args:
        name: Global name of the topic.
        data_class: Class of its messages.
        queue_size: Of the first subscriber.

    Attributes:
        closed: Whether it takes messages no more.
    """

    def __init__(self, name: str, data_class: type[Any], queue_size: int | None) -> None:
        self.name = self.resolved_name = name
        self.data_class = data_class
        self.type: str = data_class._type
        self.queue_size = queue_size
        self.closed = False
        self._lock = threading.RLock()
        self._members: tuple[_Member, ...] = ()
        self._subscription: Subscription[Any] | GenericSubscription | None = None
        self._origins: dict[bytes, Token] = {}
        self._latched: dict[bytes, tuple[Any, MessageInfo]] = {}

    def open(self, node: Node) -> None:
        """Begin to listen, now that there is a node."""
        with self._lock:
            if self.closed:
                return
            depth = self.queue_size or 0
            qos = QoS(depth=depth if depth > 0 else _NO_LIMIT)
            if self.data_class is AnyMsg:
                self._subscription = GenericSubscription(
                    node, self.name, self._take_any, qos, raw=True, with_info=True
                )
            elif self.name in _LOGS and self.type == "rosgraph_msgs/Log":
                from rosz.ros1.rospy.rosout import Ros2Log

                self._subscription = Subscription(
                    node, "/rosout", Ros2Log, self._take_log, qos, with_info=True
                )
            else:
                self._subscription = Subscription(
                    node, self.name, self.data_class, self._take, qos, with_info=True
                )
            node.keep(self._subscription)

    def join(
        self, member: object, callback: Callable[..., object] | None, callback_args: Any
    ) -> None:
        """Count one more subscriber in; the first one begins to listen.

        A later one gets at once what latching publishers have sent to the others.
        """
        with self._lock:
            first = not self._members
            newcomer = (member, callback, callback_args)
            self._members = (*self._members, newcomer)
        if first:
            when_ready(self.open)
            return
        self._look()
        missed = list(self._latched.values())
        for message, info in missed:
            self._deliver(message, info, (newcomer,))

    def release(self, member: object) -> None:
        """Count a subscriber out; the last one closes this."""
        with state.lock:
            self._members = tuple(one for one in self._members if one[0] is not member)
            if self._members:
                return
            self.closed = True
            state.sinks.pop((self.name, self.data_class), None)
        if self._subscription is not None:
            self._subscription.close()

    def get_num_connections(self) -> int:
        """Return how many publishers there are."""
        subscription = self._subscription
        if subscription is None or subscription.closed:
            return 0
        return len(subscription.publishers())

    def connection_header(self, info: MessageInfo) -> dict[str, str]:
        """Return what rospy calls the header of the connection that a message came on."""
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
            except RoszError:  # a type that is not known here, which AnyMsg is for
                return header | {"md5sum": AnyMsg._md5sum, "message_definition": ""}
        return header | {"md5sum": kind._md5sum, "message_definition": kind._full_text}

    def _origin(self, publisher: bytes) -> Token | None:
        """Return the publisher of that id, as far as the graph knows it."""
        found = self._origins.get(publisher)
        if found is None:
            self._look()
            found = self._origins.get(publisher)
        return found

    def _look(self) -> None:
        """Learn who publishes, and forget what those latched who no longer do."""
        subscription = self._subscription
        tokens = subscription.publishers() if subscription is not None else []
        self._origins = origins = {gid(format_token(token)): token for token in tokens}
        with self._lock:
            self._latched = {one: kept for one, kept in self._latched.items() if one in origins}

    def _take(self, message: Any, info: MessageInfo) -> None:
        origin = self._origins.get(info.gid) or self._origin(info.gid)
        if origin is not None and origin.qos is not None and origin.qos.latched:
            with self._lock:
                self._latched[info.gid] = (message, info)
                members = self._members
        else:
            members = self._members
        self._deliver(message, info, members)

    def _take_log(self, line: Any, info: MessageInfo) -> None:
        from rosz.ros1.rospy.rosout import to_ros1

        self._take(to_ros1(line), info)

    def _take_any(self, payload: bytes, info: MessageInfo) -> None:
        message = AnyMsg()
        message._buff = payload  # noqa: SLF001  # rospy's names for it
        message._connection_header = self.connection_header(info)  # noqa: SLF001
        self._take(message, info)

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
                # From the callback on: how it came to be called says nothing.
                lines = traceback.format_exception(error.with_traceback(trace and trace.tb_next))
                state.node.log.error("bad callback: %s\n%s", callback, "".join(lines))


def acquire_sink(name: str, data_class: type[Any], queue_size: int | None) -> Sink:
    """Return what listens to a topic, made at the first asking."""
    with state.lock:
        sink: Sink | None = state.sinks.get((name, data_class))
        if sink is None:
            sink = state.sinks[name, data_class] = Sink(name, data_class, queue_size)
    return sink


def _delivered(message: Message) -> dict[str, str]:
    """Return the header of the connection of the message that this thread delivers."""
    delivery = getattr(state.local, "delivery", None)
    if delivery is None or delivery[0] is not message:
        raise AttributeError(
            f"'{type(message).__name__}' has its {_HEADER} only in the callback it is passed to"
        )
    header: dict[str, str] = delivery[1].connection_header(delivery[2])
    return header


# rospy hangs the header on each message; here it is found when it is asked for.
setattr(Message, _HEADER, property(_delivered))
