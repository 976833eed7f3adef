"""How long a publisher of clouds takes while others receive them, in turn within one run.

The publisher and all that receive run from the beginning to the end, and what receives is switched
every few messages. So what else runs on the machine disturbs all of them alike.
"""

from __future__ import annotations

import json
import statistics
from collections.abc import Mapping
from typing import Protocol

from network import Network, Program, free_port

from .figures import OWN, Figure, percentile

__all__ = ("CLOUD_BYTES", "Copies", "Listener", "Readers", "Sink", "publishing_figures")

CLOUD_BYTES = 10_000_000
TIMEOUT = 180.0

TALKER = """
import json, sys, time
from rosz.node import Node
from rosz.msgs.sensor_msgs.msg import PointCloud2, PointField
size, period, count, warm = int(sys.argv[1]), 1 / float(sys.argv[2]), int(sys.argv[3]), 2
with Node("talker") as node:
    publisher = node.publisher("/cloud", PointCloud2, queue_size=1)
    fields = [PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate("xyzi")]
    cloud = PointCloud2(height=1, width=size // 16, fields=fields, point_step=16, row_step=size,
        data=bytes(size), is_dense=True)
    cloud.header.frame_id = "map"
    for _ in sys.stdin:
        publisher.wait_for_subscribers(1, 120)
        times = []
        for _ in range(warm + count):
            begun = time.perf_counter()
            publisher.publish(cloud)
            times.append(time.perf_counter() - begun)
            time.sleep(max(0, period - times[-1]))
        print("times", json.dumps(times[warm:]), flush=True)
        while publisher.subscribers():
            time.sleep(0.02)
        print("gone", flush=True)
"""
LISTENER = """
import sys
from rosz.node import Node
from rosz.msgs.sensor_msgs.msg import PointCloud2
with Node("listener") as node:
    for _ in sys.stdin:
        seen = []
        take = node.subscription("/cloud", PointCloud2, seen.append, raw=True, queue_size=1)
        print("on", flush=True)
        sys.stdin.readline()
        take.close()
        print("off", len(seen), flush=True)
"""
COPIER = """
import socket, sys, threading
from rosz.node import Node
from rosz.msgs.sensor_msgs.msg import PointCloud2
class Copy:
    def __init__(self, link):
        self.link, self.newest, self.changed = link, None, threading.Condition()
        threading.Thread(target=self.run, daemon=True).start()
    def take(self, data):
        with self.changed:
            self.newest = data
            self.changed.notify()
    def run(self):
        try:
            while True:
                with self.changed:
                    self.changed.wait_for(lambda: self.newest is not None)
                    data, self.newest = self.newest, None
                self.link.sendall(data)
        except OSError:
            return
with Node("copier") as node, socket.create_server(("127.0.0.1", int(sys.argv[1]))) as server:
    print("ready", flush=True)
    for _ in sys.stdin:
        copies = [Copy(server.accept()[0]) for _ in range(int(sys.argv[2]))]
        def take(data):
            for copy in copies:
                copy.take(data)
        subscription = node.subscription("/cloud", PointCloud2, take, raw=True, queue_size=1)
        sys.stdin.readline()
        subscription.close()
        for copy in copies:
            copy.link.shutdown(socket.SHUT_RDWR)
"""
READERS = """
import socket, sys, threading
port, count, size, hello = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
class Reader:
    def __init__(self):
        self.link, self.size = socket.create_connection(("127.0.0.1", port)), 0
        self.link.sendall(bytes.fromhex(hello))
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()
    def run(self):
        room = bytearray(1 << 18)
        while number := self.link.recv_into(room):
            self.size += number
for _ in sys.stdin:
    readers = [Reader() for _ in range(count)]
    print("on", flush=True)
    sys.stdin.readline()
    for reader in readers:
        reader.link.shutdown(socket.SHUT_RDWR)
        reader.thread.join()
        reader.link.close()
    print("off", sum(reader.size for reader in readers) / count / size, flush=True)
"""


class Sink(Protocol):
    """What receives clouds while it is switched on."""

    def switch_on(self) -> None:
        """Begin to receive."""

    def switch_off(self) -> float:
        """Receive no more; return how many came, to each of its readers."""


class Listener:
    """A node.

    Args:
        network: Network of the publisher.
        program: Program that is switched by lines, if not a node.
    """

    def __init__(self, network: Network, program: Program | None = None) -> None:
        self._program = program or network.program(LISTENER)
        self._before = 0

    def switch_on(self) -> None:
        self._before = len(self._program.lines)
        self._program.say("on")
        self._program.wait_for("on", TIMEOUT, after=self._before)

    def switch_off(self) -> float:
        self._program.say("off")
        return float(self._program.wait_for("off", TIMEOUT, after=self._before).split()[1])


class Readers(Listener):
    """Sockets of a process that reads what comes, and does nothing with it.

    Args:
        network: Network of the publisher.
        port: Port that they connect to.
        count: Number of sockets.
        hello: Bytes that each sends first.
        size: Bytes that each receives for a cloud.
    """

    def __init__(
        self, network: Network, port: int, count: int, hello: bytes, size: int = CLOUD_BYTES
    ) -> None:
        options = (str(port), str(count), str(size), hello.hex())
        super().__init__(network, network.program(READERS, *options))


class Copies(Readers):
    """A node that copies the bytes of clouds to sockets: the least that any bridge does."""

    def __init__(self, network: Network, count: int) -> None:
        port = free_port()
        self._copier = network.program(COPIER, str(port), str(count))
        self._copier.wait_for("ready", TIMEOUT)
        super().__init__(network, port, count, b"")

    def switch_on(self) -> None:
        self._copier.say("on")
        super().switch_on()

    def switch_off(self) -> float:
        self._copier.say("off")
        return super().switch_off()


def publishing_figures(
    name: str, came: Figure, network: Network, sinks: Mapping[str, Sink], rounds: int, count: int
) -> list[Figure]:
    """Measure how long the publisher takes, with 5 clouds per second.

    Args:
        name: What receives.
        came: Figure of the clouds that come to each.
        network: The network.
        sinks: What receives, each in turn.
        rounds: How often.
        count: Clouds of a round.

    Returns:
        The median, the 99th percentile, and what came.
    """
    asked = {system: "about 1" for system in sinks if system != OWN}
    middle = Figure(f"{name}: publishing, median", "ms", asked)
    slow = Figure(f"{name}: publishing, p99", "ms", asked)
    talker = network.program(TALKER, str(CLOUD_BYTES), "5", str(count))
    times: dict[str, list[float]] = {system: [] for system in sinks}
    totals = dict.fromkeys(sinks, 0.0)
    for _ in range(rounds):
        for system, sink in sinks.items():
            sink.switch_on()
            before = len(talker.lines)
            talker.say("go")
            line = talker.wait_for("times", TIMEOUT, after=before)
            found = json.loads(line.partition(" ")[2])
            middle.add(system, statistics.median(found))
            times[system] += found
            totals[system] += sink.switch_off()
            talker.wait_for("gone", TIMEOUT, after=before)
    for system, found in times.items():
        slow.add(system, percentile(found, 99))
        came.add(system, totals[system])
    return [middle, slow, came]
