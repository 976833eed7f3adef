"""rosserial_python beside a device that follows the description of the protocol."""

from __future__ import annotations

import errno
import os
import select
import signal
import socket
import struct
import sys
import time
import tty
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, Program, eventually

from rosz.errors import ServiceError
from rosz.msgs.rosserial_msgs.msg import TopicInfo
from rosz.msgs.std_msgs.msg import Header, String
from rosz.msgs.std_srvs.srv import SetBool, Trigger
from rosz.node import Node
from rosz.programs.rosserial import (
    Damage,
    Link,
    Packet,
    PacketReader,
    TcpServer,
    open_serial,
    pack,
)
from rosz.programs.rosserial.server import main

REQUEST = bytes.fromhex("ff fe 00 00 ff 00 00 ff")
"""The request for topics, as the description has it."""


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def frame(topic: int, payload: bytes) -> bytes:
    low, high = len(payload) & 255, len(payload) >> 8
    body = bytes([topic & 255, topic >> 8]) + payload
    return (
        bytes([255, 254, low, high, 255 - (low + high) % 256])
        + body
        + bytes([255 - sum(body) % 256])
    )


def info(topic: int, name: str, kind: str, md5: str, size: int = 512) -> bytes:
    return struct.pack("<H", topic) + text(name) + text(kind) + text(md5) + struct.pack("<i", size)


class Board:
    """The device, which reads and writes one end of a line.

    Args:
        descriptor: Its end.
    """

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        self.buffer = b""

    def send(self, topic: int, payload: bytes) -> None:
        os.write(self.descriptor, frame(topic, payload))

    def receive(self, topic: int) -> bytes:
        """Return the payload of the next packet of a topic; others are left out."""
        deadline = time.monotonic() + TIMEOUT
        while True:
            while len(self.buffer) >= 8:
                assert self.buffer[:2] == b"\xff\xfe", self.buffer
                size = self.buffer[2] + 256 * self.buffer[3]
                if len(self.buffer) < size + 8:
                    break
                found, self.buffer = self.buffer[: size + 8], self.buffer[size + 8 :]
                number, payload = found[5] + 256 * found[6], found[7:-1]
                assert found == frame(number, payload)
                if number == topic:
                    return payload
            left = max(0.0, deadline - time.monotonic())
            assert select.select([self.descriptor], [], [], left)[0], f"no packet of {topic}"
            self.buffer += os.read(self.descriptor, 4096)

    def announce(self, how: int, *what: Any) -> None:
        self.send(how, info(*what))


class Line:
    """A pseudo terminal, with the device at its end."""

    def __init__(self) -> None:
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.path = os.ttyname(self.slave)
        self.board = Board(self.master)

    def unplug(self) -> None:
        os.close(self.master)
        os.close(self.slave)


@pytest.fixture
def line() -> Iterator[Line]:
    line = Line()
    yield line
    line.unplug()


@pytest.fixture
def board(network: Network, line: Line) -> Iterator[Board]:
    """A device on the line of a node, whose topics have been requested."""
    node = network.node("serial_node")
    link = Link(node, open_serial(line.path, 57600), startup=0.0)
    network.thread(link.run)
    assert line.board.receive(TopicInfo.ID_PUBLISHER) == b""
    yield line.board
    link.close()


def lines_of(node: Node) -> Callable[[], list[str]]:
    """Return a function that returns the lines of the log of all nodes, from now on."""
    found: list[str] = []
    # Some may be logged before the publisher is found, more than a usual queue asks it for then.
    node.subscription(
        "/rosout", "rcl_interfaces/Log", lambda log: found.append(log.msg), queue_size=0
    )
    return lambda: list(found)


def heard(user: Node, topic: str) -> SimpleQueue[Any]:
    messages: SimpleQueue[Any] = SimpleQueue()
    user.subscription(topic, String, messages.put)
    return messages


def test_packets_and_damage_in_pieces_of_any_size() -> None:
    first, second = frame(125, b"one"), frame(0x1234, bytes(range(256)))
    inside = frame(7, b"kept")
    stream = (
        b"boot\r\n" + first
        + b"\xff\xff" + second
        + b"\xff\xfe\x05\x00\x00" + first
        + b"\xff\xfe" + struct.pack("<H", len(inside)) + bytes([255 - len(inside)]) + b"\x01\x00"
        + inside + b"\x00" + second
    )  # fmt: skip
    expected = [
        "skipped",
        Packet(125, b"one"),
        "protocol version 0xff (rosserial 0.4 and earlier), expected 0xfe",
        Packet(0x1234, bytes(range(256))),
        "wrong checksum of a packet's length",
        "skipped",
        Packet(125, b"one"),
        "wrong checksum of a packet",
        "skipped",
        Packet(7, b"kept"),
        "skipped",
        Packet(0x1234, bytes(range(256))),
    ]
    for size in (1, 7, len(stream)):
        reader = PacketReader()
        pieces = (stream[at : at + size] for at in range(0, len(stream), size))
        found = [one for piece in pieces for one in reader.feed(piece)]
        for one, wanted in zip(found, expected, strict=True):
            if isinstance(wanted, str):
                assert isinstance(one, Damage)
                assert one.reason.startswith(wanted)
            else:
                assert one == wanted
    assert pack(Packet(125, b"one")) == first
    assert pack(Packet(0, b"")) == REQUEST


def test_the_rest_of_a_packet_that_does_not_come() -> None:
    reader = PacketReader()
    assert list(reader.feed(frame(1, bytes(100))[:40] + frame(2, b"next"))) == []
    assert [one for one in reader.expire() if isinstance(one, Packet)] == [Packet(2, b"next")]
    assert list(reader.expire()) == []


def test_a_device_publishes_and_subscribes(network: Network, board: Board) -> None:
    user = network.node("user")
    messages = heard(user, "/chatter")
    publisher = user.publisher("/orders", Header)
    board.announce(0, 125, "chatter", "std_msgs/String", String._md5sum)
    board.announce(1, 101, "orders", "std_msgs/Header", Header._md5sum, 40)
    publisher.wait_for_subscribers(timeout=TIMEOUT)
    publisher.publish(frame_id="x" * 100)  # longer than the device's buffer
    publisher.publish(frame_id="ab")
    assert board.receive(101)[4:] == struct.pack("<II", 0, 0) + text("ab")
    eventually(lambda: user.context.graph.view().publishers("/chatter"))
    os.write(board.descriptor, b"\xff\xfe\x00garbage")
    board.send(125, text("hello"))
    assert messages.get(timeout=TIMEOUT).data == "hello"
    board.announce(0, 126, "chatter", "std_msgs/String", String._md5sum)
    board.send(126, text("again"))
    assert messages.get(timeout=TIMEOUT).data == "again"


def test_a_device_serves_and_calls(network: Network, board: Board) -> None:
    user = network.node("user")
    user.service("/greet", Trigger, lambda _: (True, "hello"))
    request, response = SetBool.Request._md5sum, SetBool.Response._md5sum
    board.announce(2, 125, "switch", "std_srvs/SetBool", response)
    board.announce(3, 101, "switch", "std_srvs/SetBool", request)
    client = user.client("/switch", SetBool)
    client.wait_for_service(TIMEOUT)
    responses: SimpleQueue[Any] = SimpleQueue()
    network.thread(lambda: responses.put(client(data=True, timeout=TIMEOUT)))
    assert board.receive(101) == b"\x01"
    board.send(125, b"\x01" + text("done"))
    assert responses.get(timeout=TIMEOUT) == SetBool.Response(success=True, message="done")
    board.announce(4, 126, "greet", "std_srvs/Trigger", Trigger.Request._md5sum)
    board.announce(5, 102, "greet", "std_srvs/Trigger", Trigger.Response._md5sum)
    board.send(126, b"")
    assert board.receive(102) == b"\x01" + text("hello")


def test_a_call_ends_with_the_device(network: Network, line: Line) -> None:
    node, user = network.node("serial_node"), network.node("user")
    link = Link(node, open_serial(line.path, 57600), startup=0.0)
    network.thread(link.run)
    line.board.announce(2, 125, "reset", "std_srvs/Trigger", Trigger.Response._md5sum)
    line.board.announce(3, 101, "reset", "std_srvs/Trigger", Trigger.Request._md5sum)
    client = user.client("/reset", Trigger)
    client.wait_for_service(TIMEOUT)

    def end() -> None:
        line.board.receive(101)
        link.close()

    network.thread(end)
    with pytest.raises(ServiceError):
        client(timeout=TIMEOUT)
    assert line.board.receive(TopicInfo.ID_TX_STOP) == b""


def test_parameters_time_and_logs(network: Network, board: Board) -> None:
    user = network.node("user")
    logged = lines_of(user)
    user.params.set("/gains", [0.5, 2.0])
    user.params.set("/enabled", True)
    user.params.set("/name", "arm")
    user.params.set("/mixed", [1, "a"])
    for name in ("/gains", "/nothing", "/mixed", "/enabled", "/name"):
        board.send(6, text(name))
    empty = struct.pack("<I", 0)
    assert board.receive(6) == empty + struct.pack("<Iff", 2, 0.5, 2.0) + empty
    assert board.receive(6) == struct.pack("<Ii", 1, 1) + empty + empty
    assert board.receive(6) == empty + empty + struct.pack("<I", 1) + text("arm")
    before = int(time.time())
    board.send(10, b"")
    seconds, nanoseconds = struct.unpack("<II", board.receive(10))
    assert before <= seconds <= time.time()
    assert nanoseconds < 10**9
    board.send(7, b"\x02" + text("battery is low"))
    eventually(lambda: "battery is low" in logged(), "the device's line is in the log")
    assert any("'/nothing' is not set" in one for one in logged())
    assert any("'/mixed' is [1, 'a']" in one for one in logged())


def test_what_cannot_be_set_up(network: Network, board: Board) -> None:
    logged = lines_of(network.node("user"))
    board.announce(0, 125, "chatter", "std_msgs/String", "0" * 32)
    board.announce(0, 126, "chatter", "nowhere_msgs/String", "0" * 32)
    board.announce(1, 127, "not legal!", "std_msgs/String", String._md5sum)
    board.send(0, b"\x01")
    board.send(125, text("hello"))
    assert board.receive(TopicInfo.ID_PUBLISHER) == b""  # topics are requested again
    expected = [
        f"std_msgs/String has MD5 '{'0' * 32}', expected '{String._md5sum}'",
        "nowhere_msgs",
        "not legal!",
        "dropped a packet of topic 0",
        "before it announced that; its topics are requested again",
    ]
    eventually(lambda: all(any(text in one for one in logged()) for text in expected), "the errors")


def test_a_silent_device_has_lost_sync(network: Network, line: Line) -> None:
    node, user = network.node("serial_node"), network.node("user")
    found: SimpleQueue[Any] = SimpleQueue()
    subscription = user.subscription("/diagnostics", "diagnostic_msgs/DiagnosticArray", found.put)
    link = Link(node, open_serial(line.path, 57600), timeout=0.01, startup=0.0)
    eventually(lambda: subscription.publishers)
    network.thread(link.run)
    assert line.board.receive(0) == line.board.receive(0) == b""
    assert found.get(timeout=TIMEOUT).status[0].message == "no sync with device"
    link.close()


def test_a_device_by_tcp(network: Network) -> None:
    node, user = network.node("serial_node"), network.node("user")
    messages = heard(user, "/chatter")
    server = TcpServer(node, 0)
    network.thread(server.listen)
    for word in ("first", "second"):
        with socket.create_connection(("127.0.0.1", server.port)) as connection:
            board = Board(connection.fileno())
            assert board.receive(TopicInfo.ID_PUBLISHER) == b""
            board.announce(0, 125, "chatter", "std_msgs/String", String._md5sum)
            board.send(125, text(word))
            assert messages.get(timeout=TIMEOUT).data == word
    node.close()


def test_connections_that_cannot_be_served(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An error of accept is told, a device too many refused; the next one is served again."""
    errors = [OSError(errno.EMFILE, "Too many open files")]
    accept = socket.socket.accept

    def fail_once(self: socket.socket) -> tuple[socket.socket, Any]:
        if errors:
            raise errors.pop()
        return accept(self)

    monkeypatch.setattr("rosz.programs.rosserial.server._DEVICES", 1)
    monkeypatch.setattr(socket.socket, "accept", fail_once)
    node = network.node("serial_node")
    lines = lines_of(network.node("user"))
    server = TcpServer(node, 0)
    network.thread(server.listen)
    address = ("127.0.0.1", server.port)
    with socket.create_connection(address, TIMEOUT) as first:
        assert Board(first.fileno()).receive(TopicInfo.ID_PUBLISHER) == b""
        with socket.create_connection(address, TIMEOUT) as second:
            assert second.recv(1) == b""

    def is_served() -> bool:
        with socket.create_connection(address, TIMEOUT) as third:
            return third.recv(1) == b"\xff"

    def told(text: str) -> bool:
        return any(text in line for line in lines())

    eventually(is_served)
    assert not errors
    for text in ("cannot accept a connection: [Errno 24]", ": 1 devices are connected"):
        eventually(partial(told, text))
    node.close()


def test_errors_of_serving_are_not_those_of_parameters(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(server: TcpServer) -> None:
        server._socket.close()
        raise ValueError("from a device")

    for name, value in network.variables().items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "argv", ["serial_node.py", "tcp", "0"])
    monkeypatch.setattr(TcpServer, "listen", fail)
    with pytest.raises(ValueError, match="from a device"):
        main()


def start(network: Network, *argv: str) -> Program:
    variables = network.variables()
    for name in ("PYTHONWARNINGS", "PYTHONFAULTHANDLER"):
        del variables[name]
    return network._keep(Program([sys.executable, "-P", "-m", *argv], variables))


def test_the_program_outlives_an_unplugged_device(network: Network, tmp_path: Path) -> None:
    port = tmp_path / "ttyUSB7"
    messages = heard(network.node("user"), "/chatter")
    program = start(network, "rosz", "run", "rosserial_python", "serial_node.py", f"_port:={port}")
    program.wait_for(f"cannot open '{port}'")
    for word in ("first", "second"):
        line = Line()
        port.symlink_to(line.path)
        program.wait_for("Connected to", times=1 if word == "first" else 2)
        line.board.announce(0, 125, "chatter", "std_msgs/String", String._md5sum)
        eventually(lambda: "Setup publisher" in program.output)
        line.board.send(125, text(word))
        assert messages.get(timeout=TIMEOUT).data == word
        if word == "first":
            port.unlink()
            line.unplug()
            program.wait_for("lost the device")
    program.send(signal.SIGINT)
    assert line.board.receive(TopicInfo.ID_TX_STOP) == b""
    assert program.exit_code() == 0, program.output
    assert "Traceback" not in program.output
    line.unplug()


def test_a_script_with_a_client_of_its_own(network: Network, line: Line, tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import sys, rospy\n"
        "from rosserial_python import SerialClient\n"
        "rospy.init_node('script')\n"
        "SerialClient(sys.argv[1], 115200).run()\n"
    )
    messages = heard(network.node("user"), "/chatter")
    program = start(network, "rosz.ros1", str(script), line.path)
    assert line.board.receive(TopicInfo.ID_PUBLISHER) == b""
    line.board.announce(0, 125, "chatter", "std_msgs/String", String._md5sum)
    line.board.send(125, text("hello"))
    assert messages.get(timeout=TIMEOUT).data == "hello"
    program.send(signal.SIGTERM)
    assert line.board.receive(TopicInfo.ID_TX_STOP) == b""
    program.exit_code()
    assert "Traceback" not in program.output


DERIVED = """
import sys, rospy
from rosserial_msgs.msg import TopicInfo
from rosserial_python import Publisher, SerialClient, ServiceClient, ServiceServer, Subscriber
from rosserial_python import load_message, load_service

class Client(SerialClient):
    def setupSubscriber(self, data):
        info = TopicInfo()
        info.deserialize(data)
        self.subscribers[info.topic_name] = Subscriber(info, self)
        self.setSubscribeSize(info.buffer_size)
    def setupPublisher(self, data):
        info = TopicInfo().deserialize(data)
        if info.topic_name == "plain":
            return super().setupPublisher(data)
        try:
            self.publishers[info.topic_id] = Publisher(info)
            self.callbacks[info.topic_id] = self.publishers[info.topic_id].handlePacket
        except Exception as error:
            print(error, flush=True)
    def setupServiceServerSubscriber(self, data):
        info = TopicInfo().deserialize(data)
        self.services[info.topic_name] = ServiceServer(info, self)
    def setupServiceServerPublisher(self, data):
        info = TopicInfo().deserialize(data)
        self.callbacks[info.topic_id] = self.services[info.topic_name].handlePacket
    def setupServiceClientPublisher(self, data):
        info = TopicInfo().deserialize(data)
        made = self.services[info.topic_name] = ServiceClient(info, self)
        self.callbacks[info.topic_id] = made.handlePacket
    def setupServiceClientSubscriber(self, data):
        info = TopicInfo().deserialize(data)
        self.services[info.topic_name].id = info.topic_id

print(load_message("std_msgs", "String")._type)
print([one._type for one in load_service("std_srvs", "SetBool")])
rospy.init_node("script")
Client(sys.argv[1], 115200).run()
"""


def test_a_client_derived_in_a_script(network: Network, line: Line, tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(DERIVED)
    user, board = network.node("user"), line.board
    messages, plain = heard(user, "/chatter"), heard(user, "/plain")
    user.service("switch", SetBool, lambda request: [request.data, "switched"])
    publisher = user.publisher("/orders", String)
    program = start(network, "rosz.ros1", str(script), line.path)
    assert board.receive(TopicInfo.ID_PUBLISHER) == b""
    board.announce(0, 124, "chatter", "std_msgs/String", "0" * 32)
    board.announce(0, 125, "chatter", "std_msgs/String", String._md5sum)
    board.announce(0, 126, "plain", "std_msgs/String", String._md5sum)
    board.send(125, text("hello"))
    board.send(126, text("plain hello"))
    assert messages.get(timeout=TIMEOUT).data == "hello"
    assert plain.get(timeout=TIMEOUT).data == "plain hello"
    board.announce(1, 101, "orders", "std_msgs/String", String._md5sum, 20)
    publisher.wait_for_subscribers(timeout=TIMEOUT)
    publisher.publish(data="x" * 20)  # longer than the device's buffer
    publisher.publish(data="go")
    assert board.receive(101) == text("go")
    board.announce(3, 102, "start", "std_srvs/Trigger", Trigger.Request._md5sum)
    board.announce(2, 127, "start", "std_srvs/Trigger", Trigger.Response._md5sum)
    client = user.client("start", Trigger)
    client.wait_for_service(timeout=TIMEOUT)
    responses: SimpleQueue[Any] = SimpleQueue()
    network.thread(lambda: responses.put(client(timeout=TIMEOUT)))
    assert board.receive(102) == b""
    board.send(127, b"\x01" + text("started"))
    assert responses.get(timeout=TIMEOUT).message == "started"
    board.announce(4, 128, "switch", "std_srvs/SetBool", SetBool.Request._md5sum)
    board.announce(5, 103, "switch", "std_srvs/SetBool", SetBool.Response._md5sum)
    board.send(128, b"\x01")
    assert board.receive(103) == b"\x01" + text("switched")
    program.send(signal.SIGTERM)
    program.exit_code()
    assert "['std_srvs/SetBool', 'std_srvs/SetBoolRequest'" in program.output
    assert f"has MD5 '{'0' * 32}', expected '{String._md5sum}'" in program.output
    assert "it has 24 bytes, the device's buffer 20" in program.output
    assert "Traceback" not in program.output


@pytest.mark.parametrize(
    ("word", "reason"),
    [("_baud:=fast", "invalid literal"), ("_tcp_port:=70000", "cannot listen at TCP port 70000")],
)
def test_wrong_parameters(network: Network, word: str, reason: str) -> None:
    port = "_port:=tcp" if "tcp" in word else "_port:=/dev/nowhere"
    program = start(network, "rosz", "run", "rosserial_python", "serial_node.py", port, word)
    assert program.exit_code() == 1
    assert reason in program.output
    assert "Traceback" not in program.output
