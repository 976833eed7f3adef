"""Through the bridge to ROS 1, beside ROS 1 alone: ``python -m tests.bench.bridge [SECONDS]``.

A rosz node and a rospy node send text to the same roscpp program and back, in turn, and bare Zenoh
to a program of its own: what crosses goes both ways, so less than the sum cannot be. Then images go
to a rospy subscriber, from a rosz node through the bridge and from rospy directly, at several
rates, of which the best of each counts: a publisher that floods a busy machine takes the processor
from the others, and rosz floods faster than rospy. The last figures are the time until 500 topics
that ROS 1 registers at once are known to rosz, and the processor time of the bridge when nothing
happens.
"""

from __future__ import annotations

import json
import os
import statistics
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import zenoh

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "tests"))

from bridges.ros1.world import roscpp  # noqa: E402  # found by the line above
from network import Network, Program, eventually, free_port  # noqa: E402
from oracle import PYTHON  # noqa: E402

from rosz.msgs.sensor_msgs.msg import Image  # noqa: E402
from rosz.msgs.std_msgs.msg import String  # noqa: E402
from rosz.node import Node  # noqa: E402

ROUNDS = 500
REPEATS = 7
PUBLISHED = (50, 100, 200, 400, 800)
"""Images per second."""

TOPICS = 500
TIMEOUT = 60.0

PING = """
import rospy, statistics, sys, threading, time
from std_msgs.msg import String
rospy.init_node("ping")
back = threading.Event()
rospy.Subscriber("echoed", String, lambda _: back.set(), tcp_nodelay=True)
publisher = rospy.Publisher("chatter", String, queue_size=1, tcp_nodelay=True)
while not back.wait(0.1):
    publisher.publish("x")
times = []
for _ in range(int(sys.argv[1])):
    back.clear()
    begun = time.perf_counter()
    publisher.publish("x")
    back.wait(10)
    times.append(time.perf_counter() - begun)
print("median %r" % statistics.median(times))
"""
BARE_ECHO = """
import sys, zenoh
session = zenoh.open(zenoh.Config.from_json5(sys.argv[1]))
publisher = session.declare_publisher("echoed")
session.declare_subscriber("chatter", lambda sample: publisher.put(sample.payload))
print("ready")
sys.stdin.read()
"""
COUNT = """
import rospy, sys, time
from sensor_msgs.msg import Image
rospy.init_node("count")
seen = []
def heard(message):
    seen.append(time.perf_counter())
    if len(seen) > 1 and seen[-1] - seen[0] > float(sys.argv[1]):
        print("rate %r" % ((len(seen) - 1) / (seen[-1] - seen[0])))
        rospy.signal_shutdown("done")
rospy.Subscriber("image", Image, heard, queue_size=1, buff_size=1 << 24)
print("ready")
rospy.spin()
"""
SEND = """
import rospy, sys
from sensor_msgs.msg import Image
rospy.init_node("send")
publisher = rospy.Publisher("image", Image, queue_size=1)
image = Image(data=bytes(int(sys.argv[1])))
rate = rospy.Rate(int(sys.argv[2]))
while not rospy.is_shutdown():
    publisher.publish(image)
    rate.sleep()
"""
BURST = """
import rospy, sys
from std_msgs.msg import String
rospy.init_node("burst")
keep = [rospy.Publisher("burst/t%d" % n, String, queue_size=1) for n in range(int(sys.argv[1]))]
print("ready")
rospy.spin()
"""


class Bridge:
    """A core with ROS 1's master, and programs on both sides of it."""

    def __init__(self) -> None:
        self.network = Network()
        self.port = free_port()
        self.core = self.network.run("-m", "rosz", "core", "--ros1", "--port", str(self.port))
        self.core.wait_for("started core", TIMEOUT)

    def ros1(self, *command: str) -> Program:
        """Start a program of ROS 1."""
        variables = {
            "PATH": "/usr/bin:/bin",
            "HOME": str(self.network.folder),
            "ROS_MASTER_URI": f"http://127.0.0.1:{self.port}",
            "ROS_IP": "127.0.0.1",
            "PYTHONUNBUFFERED": "1",
        }
        return Program(command, variables)

    def seconds(self) -> float:
        """Return the processor time of the core."""
        fields = Path(f"/proc/{self.core.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _number(program: Program, word: str) -> float:
    line = program.wait_for(word, TIMEOUT)
    program.close()
    return float(line.split()[1])


def _median(publish: Callable[[], object], back: threading.Event) -> float:
    """Return how long it takes until something published has come back, in seconds."""
    while not back.wait(0.1):
        publish()
    times = []
    for _ in range(ROUNDS):
        back.clear()
        begun = time.perf_counter()
        publish()
        back.wait(10)
        times.append(time.perf_counter() - begun)
    return statistics.median(times)


def _round_trip(node: Node) -> float:
    back = threading.Event()
    with (
        node.publisher("/chatter", String, queue_size=1) as publisher,
        node.subscription("/echoed", String, lambda _: back.set()),
    ):
        return _median(lambda: publisher.publish("x"), back)


def _bare_round_trip(network: Network) -> float:
    """Return the time of bare Zenoh between two processes."""
    config = {"mode": "peer", "scouting": {"multicast": {"enabled": False}}}
    place = {"endpoints": [f"unixsock-stream/{network.folder}/bare.sock"]}
    echo = network.run("-c", BARE_ECHO, json.dumps(config | {"listen": place}))
    echo.wait_for("ready", TIMEOUT)
    back = threading.Event()
    with zenoh.open(zenoh.Config.from_json5(json.dumps(config | {"connect": place}))) as session:
        publisher = session.declare_publisher("chatter")
        session.declare_subscriber("echoed", lambda _: back.set())
        median = _median(lambda: publisher.put(b"x"), back)
    echo.close()
    return median


def _image_rate(bridge: Bridge, node: Node, size: int, published: int, seconds: float) -> float:
    counter = bridge.ros1(PYTHON, "-c", COUNT, str(seconds))
    counter.wait_for("ready", TIMEOUT)
    image = Image(data=bytes(size))
    with node.publisher("/image", Image, queue_size=1) as publisher:
        publisher.wait_for_subscribers(timeout=TIMEOUT)
        timer = node.timer(1 / published, lambda _: publisher.publish(image))
        try:
            return _number(counter, "rate")
        finally:
            timer.close()


def main(seconds: float) -> None:
    """Measure, and print the figures."""
    bridge = Bridge()
    node = bridge.network.node("bench")
    echo = bridge.ros1(roscpp(), "echo")
    echo.wait_for("ready", TIMEOUT)
    ratios, bounds = [], []
    for _ in range(REPEATS):
        through = _round_trip(node)
        bare = _bare_round_trip(bridge.network)
        direct = _number(bridge.ros1(PYTHON, "-c", PING, str(ROUNDS)), "median")
        ratios.append(through / direct)
        bounds.append((bare + direct) / direct)
        print(
            f"there and back: {through * 1e6:.0f} us, rospy {direct * 1e6:.0f} us,"
            f" bare Zenoh {bare * 1e6:.0f} us"
        )
    print(
        f"ratio {statistics.median(ratios):.2f}, {min(ratios):.2f} to {max(ratios):.2f}"
        f" (aim 2.5 at most; rospy and bare Zenoh {statistics.median(bounds):.2f});"
        f" load {os.getloadavg()[0]:.1f}"
    )
    echo.close()
    for size, aim in ((1_000_000, "ratio 0.5 at least"), (10_000_000, "200 MB/s at least")):
        through, direct = 0.0, 0.0
        for rate in PUBLISHED:
            through = max(through, _image_rate(bridge, node, size, rate, seconds))
            sender = bridge.ros1(PYTHON, "-c", SEND, str(size), str(rate))
            direct = max(direct, _number(bridge.ros1(PYTHON, "-c", COUNT, str(seconds)), "rate"))
            sender.close()
        print(
            f"images of {size / 1e6:g} MB: {through * size / 1e6:.0f} MB/s, rospy"
            f" {direct * size / 1e6:.0f} MB/s, ratio {through / direct:.2f} (aim {aim})"
        )
    burst = bridge.ros1(PYTHON, "-c", BURST, str(TOPICS))
    burst.wait_for("ready", TIMEOUT)
    begun = time.perf_counter()
    view = node.context.graph.view
    eventually(lambda: sum("/burst/t" in topic for topic in view().topics()) == TOPICS, "all", 60)
    print(f"{TOPICS} topics known {time.perf_counter() - begun:.1f} s after the last (aim 2 s)")
    used = bridge.seconds()
    time.sleep(seconds)
    share = (bridge.seconds() - used) / seconds
    print(f"idle with {TOPICS} topics: {share:.1%} of a processor (aim 2 %)")
    burst.close()
    bridge.network.close()


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 2.0)
