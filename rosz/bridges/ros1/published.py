"""Publishers on the network for the topics that ROS 1's nodes publish.

Each publisher of ROS 1 is declared on the network at once, so that others see it. The bridge
connects to the node while the network has a subscription. Messages are received on the thread of
the socket loop; everything else runs on the thread for changes, unless a docstring says otherwise.
"""

from __future__ import annotations

import socket
from collections.abc import Callable
from functools import partial
from typing import Any

from rosz.bridges.ros1.codec import Codec
from rosz.bridges.ros1.frames import MAX_FRAME, FrameReader
from rosz.bridges.ros1.peers import Address, call, connect_either, exchange_headers
from rosz.bridges.ros1.registry import ANY_TYPE, RegistryEntry
from rosz.bridges.ros1.shared import BRIDGE, QUEUE, BridgeResources, TopicConnection
from rosz.bridges.ros1.sockets import Handler, Stream, log
from rosz.errors import ClosedError, DecodeError, MessageError, RoszError, TypeNotFound
from rosz.node import BridgedNode, Publisher
from rosz.qos import QoS, for_queue
from rosz.wire import Kind

_LATCHED = QoS(depth=1, durability="transient_local")
_FIRST_RETRY = 0.1
_LAST_RETRY = 2.0


class PublishedTopic(Handler):
    """A topic that a node of ROS 1 publishes."""

    def __init__(self, shared: BridgeResources, node: BridgedNode, entry: RegistryEntry) -> None:
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
        """Why the node could not be connected to; empty once it could."""
        self._damage = ""
        self._received = 0
        self._reader = FrameReader(MAX_FRAME)
        try:
            self._codec = shared.codecs.of_ros1(entry.name, entry.type_name)
        except RoszError:
            pass  # the connection header of the publisher has the definition
        else:
            self._declare(latched=False)
        self.update()

    def connections(self) -> list[TopicConnection]:
        """Return a list with the connection to the node; empty if there is none."""
        stream = self._stream
        if stream is None:
            return []
        return [TopicConnection(self.entry.node, True, stream.received_bytes, self._received)]

    @property
    def is_connecting(self) -> bool:
        """Whether the node has neither accepted nor refused a requested connection."""
        return self._connecting and not self._reported

    def when_connected(self, task: Callable[[], object]) -> None:
        """Run a task on the thread for changes once the connection attempt has ended."""
        self._when_connected.append(task)

    def update(self) -> None:
        """Connect to the node if the network has a subscription; otherwise disconnect."""
        if self._closed:
            return
        wanted = self._codec is None or bool(
            self._shared.entities(Kind.SUBSCRIPTION, name=self._topic)
        )
        if wanted and self._stream is None and not self._connecting:
            self._connecting = True
            if not self._shared.requests.offer(self._connect):
                self._retry()
        elif not wanted and self._stream is not None:
            self._disconnect()
            if self._publisher is not None and self._publisher.qos.latched:
                # Drop the stored message: the node sends it again at the next connection.
                self._declare(latched=True)

    def close(self) -> None:
        """Remove the topic from the network."""
        self._closed = True
        self._end_connecting()
        self._disconnect()
        self._undeclare()

    def _declare(self, *, latched: bool) -> None:
        codec = self._codec
        assert codec is not None  # noqa: S101  # the callers have checked it
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
        """Connect to the node. This runs on a thread for requests."""
        shared, entry = self._shared, self.entry
        caller = self._caller()
        try:
            answer = call(entry.uri, "requestTopic", (caller, entry.name, [["TCPROS"]]))
            match answer:
                case ["TCPROS", host, int(port), *_]:
                    sock = connect_either(Address(str(host), port), entry.uri)
                case _:
                    raise DecodeError("XML-RPC result", -1, f"{answer!r:.80}, expected TCPROS")
        except RoszError as error:
            shared.changes.submit(partial(self._failed, str(error)))
            return
        fields = {
            "callerid": caller,
            "topic": entry.name,
            "type": entry.type_name,
            "md5sum": ANY_TYPE,  # any; the answer has the definition if it differs from ours
            "tcp_nodelay": "1",
        }
        try:
            header = exchange_headers(sock, fields)
        except RoszError as error:
            sock.close()
            shared.changes.submit(partial(self._failed, str(error)))
            return
        if not shared.changes.offer(partial(self._connected, sock, header, caller)):
            sock.close()  # the bridge was closed during the connection attempt

    def _caller(self) -> str:
        """Return the name of the subscribing node for which the bridge connects."""
        if self.entry.node.startswith(BRIDGE):
            return self._shared.name
        return self._shared.standing_for(Kind.SUBSCRIPTION, self._topic)

    def _connected(self, sock: socket.socket, header: dict[str, str], caller: str) -> None:
        if not self._closed and caller != self._caller():
            # The connection was made in the name of a node that has ended. Action clients in C++
            # wait for ever if a server has different node names on its topics.
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
        if not self._shared.entities(Kind.SUBSCRIPTION, name=self._topic):
            sock.close()
            return
        publisher = self._publisher
        latched = header.get("latching") == "1"
        if publisher is None or (latched and not publisher.qos.latched):
            self._declare(latched=latched)
        self._delay, self._reported, self._damage = _FIRST_RETRY, "", ""
        self._reader = FrameReader(MAX_FRAME)
        self._stream = Stream(self._shared.loop, sock, self)

    def _learn(self, header: dict[str, str]) -> Codec:
        """Return the codec for the definition in the connection header of the node."""
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

    # The stream calls the following methods on the thread of the loop.

    def space(self) -> memoryview:
        """Return the memory for the next bytes."""
        return self._reader.space()

    def received(self, count: int) -> None:
        """Publish the messages that are now complete."""
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
                if str(error) != self._damage:
                    self._damage = str(error)
                    log.warning(
                        "dropping a damaged message on '%s' from node '%s' (told once): %.300s",
                        self.entry.name,
                        self.entry.node,
                        error,
                    )

    def closed(self) -> None:
        """Connect again later, and check whether the node is still alive."""
        self._shared.changes.submit(self._lost)

    def _lost(self) -> None:
        if self._stream is not None and self._stream.is_closed:
            self._stream = None
            self._shared.prober.check(self.entry.node, self.entry.uri)
            self._retry()
