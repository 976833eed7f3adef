"""Topics that ROS 1's nodes publish, on the network.

A publisher of ROS 1 is a publisher on the network at once, so that others see it. The bridge
connects to it when the network has a subscription, and disconnects with the last. All of this runs
on the thread for changes, but for the bytes of messages.
"""

from __future__ import annotations

import socket
from collections.abc import Callable
from functools import partial
from typing import Any

from rosz.bridges.ros1.codec import Codec
from rosz.bridges.ros1.frames import MAX_FRAME, FrameReader
from rosz.bridges.ros1.peers import Address, call, connect, exchange_headers
from rosz.bridges.ros1.registry import ANY_TYPE, Entry
from rosz.bridges.ros1.shared import BRIDGE, QUEUE, Connection, Shared
from rosz.bridges.ros1.sockets import Stream, log
from rosz.errors import ClosedError, DecodeError, MessageError, RoszError, TypeNotFound
from rosz.node import BridgedNode, Publisher
from rosz.qos import QoS, for_queue
from rosz.wire import Kind

__all__ = ("PublishedTopic",)

_LATCHED = QoS(depth=1, durability="transient_local")
_FIRST_RETRY = 0.1
_LAST_RETRY = 2.0


class PublishedTopic:
    """A topic that a node of ROS 1 publishes.

    Args:
        shared: What the bridge shares.
        node: The node.
        entry: Its registration.
    """

    def __init__(self, shared: Shared, node: BridgedNode, entry: Entry) -> None:
        self.entry = entry
        self._topic = shared.here(entry.name)
        self._shared = shared
        self._node = node
        self._codec: Codec | None = None
        self._identity = shared.identity(entry.node, Kind.PUBLISHER, entry.name)
        self._publisher: Publisher[Any] | None = None
        self._stream: Stream | None = None
        self._connecting = False
        self._when_connected: list[Callable[[], object]] = []
        self._closed = False
        self._delay = _FIRST_RETRY
        self._reported = ""
        self._received = 0
        self._reader = FrameReader(MAX_FRAME)
        try:
            self._codec = shared.codecs.of_ros1(entry.name, entry.type_name)
        except RoszError:
            pass  # the publisher tells its definition when it is connected
        else:
            self._declare(latched=False)
        self.update()

    def connections(self) -> list[Connection]:
        """Return the connection to the node, if there is one."""
        stream = self._stream
        if stream is None:
            return []
        return [Connection(self.entry.node, True, stream.received_bytes, self._received)]

    @property
    def is_connecting(self) -> bool:
        """Whether a connection was requested that the node has neither accepted nor refused."""
        return self._connecting and not self._reported

    def when_connected(self, task: Callable[[], object]) -> None:
        """Run a task on the thread for changes when the node has accepted, refused or ended."""
        self._when_connected.append(task)

    def update(self) -> None:
        """Connect to the node if the network wants its messages, or else disconnect."""
        if self._closed:
            return
        wanted = self._codec is None or bool(self._shared.subscriptions(self._topic))
        if wanted and self._stream is None and not self._connecting:
            self._connecting = True
            if not self._shared.requests.offer(self._connect):
                self._retry()
        elif not wanted and self._stream is not None:
            self._disconnect()
            if self._publisher is not None and self._publisher.qos.latched:
                # The node sends its last message again, to whoever is there then.
                self._declare(latched=True)

    def close(self) -> None:
        """Take the topic from the network."""
        self._closed = True
        self._end_connecting()
        self._disconnect()
        self._undeclare()

    def _declare(self, *, latched: bool) -> None:
        codec = self._codec
        assert codec is not None  # noqa: S101  # the callers know it
        self._undeclare()
        qos = codec.qos or (_LATCHED if latched else for_queue(QUEUE))
        try:
            publisher = Publisher(
                self._node,
                self._topic,
                codec.cls,
                qos,
                number=self._identity.number,
                sequence=self._identity.sequence,
            )
        except ClosedError:
            return
        self._shared.gids.add(publisher.gid)
        self._publisher = self._node.keep(publisher)

    def _undeclare(self) -> None:
        publisher, self._publisher = self._publisher, None
        if publisher is not None:
            publisher.close()
            self._identity.sequence = publisher.sequence
            self._shared.gids.discard(publisher.gid)

    def _disconnect(self) -> None:
        stream, self._stream = self._stream, None
        if stream is not None:
            self._shared.loop.call(stream.close)

    def _connect(self) -> None:
        """Connect to the node; runs on a thread for requests."""
        shared, entry = self._shared, self.entry
        caller = self._caller()
        try:
            answer = call(entry.uri, "requestTopic", (caller, entry.name, [["TCPROS"]]))
            if not isinstance(answer, list) or answer[:1] != ["TCPROS"] or len(answer) < 3:  # noqa: PLR2004
                raise DecodeError("XML-RPC result", -1, f"{answer!r:.80}, expected TCPROS")
            sock = _connect_either(answer, entry.uri)
        except RoszError as error:
            shared.changes.submit(partial(self._failed, str(error)))
            return
        fields = {
            "callerid": caller,
            "topic": entry.name,
            "type": entry.type_name,
            "md5sum": ANY_TYPE,  # the answer has the definition, if it is not the one known here
            "tcp_nodelay": "1",
        }
        try:
            header = exchange_headers(sock, fields)
        except RoszError as error:
            sock.close()
            shared.changes.submit(partial(self._failed, str(error)))
            return
        if not shared.changes.offer(partial(self._connected, sock, header, caller)):
            sock.close()  # the bridge has ended meanwhile

    def _caller(self) -> str:
        """Return the node that the connection stands for."""
        if self.entry.node.startswith(BRIDGE):
            return self._shared.name
        return self._shared.standing_for(Kind.SUBSCRIPTION, self._topic)

    def _connected(self, sock: socket.socket, header: dict[str, str], caller: str) -> None:
        if not self._closed and caller != self._caller():
            # The node has gone that it was made for. Clients of actions in C++ wait for ever for a
            # server that is another node on one topic than on the others.
            sock.close()
            if not self._shared.requests.offer(self._connect):
                self._retry()
            return
        self._end_connecting()
        codec = self._codec
        if self._closed:
            sock.close()
            return
        if codec is None or not codec.fits(header.get("md5sum", ANY_TYPE)):
            try:
                codec = self._learn(header)
            except RoszError as error:
                sock.close()
                self._failed(str(error))
                return
        if not self._shared.subscriptions(self._topic):
            sock.close()
            return
        publisher = self._publisher
        latched = header.get("latching") == "1"
        if publisher is None or (latched and not publisher.qos.latched):
            self._declare(latched=latched)
        self._delay, self._reported = _FIRST_RETRY, ""
        self._reader = FrameReader(MAX_FRAME)
        self._stream = Stream(self._shared.loop, sock, self)

    def _learn(self, header: dict[str, str]) -> Codec:
        """Return the codec of the definition that the node has sent."""
        entry = self.entry
        type_name = header.get("type", entry.type_name)
        definition = header.get("message_definition", "")
        self._codec = codec = self._shared.codecs.of_ros1(entry.name, type_name, definition)
        if not codec.fits(header.get("md5sum", ANY_TYPE)):
            self._codec = None
            raise TypeNotFound(
                type_name, f"its md5 is {header.get('md5sum')} there, and {codec.md5sum} here"
            )
        self._declare(latched=header.get("latching") == "1")
        return codec

    def _failed(self, reason: str) -> None:
        self._end_connecting()
        if self._closed:
            return
        if reason != self._reported:
            self._reported = reason
            log.warning(
                "cannot receive '%s' from node '%s': %.300s; trying again (told once)",
                self.entry.name,
                self.entry.node,
                reason,
            )
        self._retry()

    def _end_connecting(self) -> None:
        self._connecting = False
        tasks, self._when_connected = self._when_connected, []
        for task in tasks:
            self._shared.changes.submit(task)

    def _retry(self) -> None:
        self._end_connecting()
        self._shared.changes.later(self._delay, self.update)
        self._delay = min(2 * self._delay, _LAST_RETRY)

    # What the stream calls, on the thread of the loop.

    def space(self) -> memoryview:
        """Return where the next bytes belong."""
        return self._reader.space()

    def received(self, count: int) -> None:
        """Publish the messages that are complete."""
        codec, publisher = self._codec, self._publisher
        if codec is None or publisher is None:
            return
        for frame in self._reader.take(count):
            try:
                publisher.publish_raw(codec.to_cdr(frame))
                self._received += 1
            except ClosedError:
                return
            except MessageError as error:
                if str(error) != self._reported:
                    self._reported = str(error)
                    log.warning(
                        "dropping a damaged message on '%s' from node '%s' (told once): %.300s",
                        self.entry.name,
                        self.entry.node,
                        error,
                    )

    def closed(self) -> None:
        """Connect again if the node is still there."""
        self._shared.changes.submit(self._lost)

    def _lost(self) -> None:
        if self._stream is not None and self._stream.is_closed:
            self._stream = None
            self._shared.prober.check(self.entry.node, self.entry.uri)
            self._retry()


def _connect_either(answer: list[Any], uri: str) -> socket.socket:
    """Return a connection to the address that a node names, or to that of its URI."""
    address = Address(str(answer[1]), int(answer[2]))
    try:
        return connect(address)
    except RoszError:
        known = Address.parse(uri)
        if known.host == address.host:
            raise
        return connect(Address(known.host, address.port))
