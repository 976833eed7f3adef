"""Clouds for eight rosbridge clients, and a bridge with nothing to do."""

from __future__ import annotations

import json
import os
import statistics
import time
from pathlib import Path

from network import Network, Program, eventually, free_port

from ..figures import OWN, Figure, percentile  # noqa: TID252  # tests is no package

__all__ = ("clouds", "idle")

TIMEOUT = 120.0
PLAIN = "one node"
ENCODINGS = ("cbor-raw", "cbor", "none")

TALKER = """
import sys, threading, time, json
from rosz.node import Node
from rosz.msgs.sensor_msgs.msg import PointCloud2
size, period, count = int(sys.argv[1]), 1 / float(sys.argv[2]), int(sys.argv[3])
with Node("talker") as node:
    publisher = node.publisher("/cloud", PointCloud2, queue_size=1)
    cloud = PointCloud2(width=size, data=bytes(size))
    publisher.wait_for_subscribers(1, 60)
    print("found", flush=True)
    sys.stdin.readline()
    times = []
    for _ in range(count):
        begun = time.perf_counter()
        publisher.publish(cloud)
        times.append(time.perf_counter() - begun)
        time.sleep(max(0, period - times[-1]))
    print("times", json.dumps(times))
    sys.stdin.readline()
"""
LISTENER = """
import sys
from rosz.node import Node
from rosz.msgs.sensor_msgs.msg import PointCloud2
seen = []
with Node("listener") as node:
    node.subscription("/cloud", PointCloud2, seen.append, raw=True, queue_size=1)
    print("ready", flush=True)
    sys.stdin.readline()
    print("seen", len(seen))
"""
CLIENTS = """
import asyncio, json, sys
import websockets
async def listen(seen):
    async with websockets.connect(f"ws://127.0.0.1:{sys.argv[1]}", max_size=None) as socket:
        await socket.send(json.dumps({"op": "subscribe", "topic": "/cloud",
            "type": "sensor_msgs/PointCloud2", "compression": sys.argv[2]}))
        async for frame in socket:
            seen.append(len(frame))
async def main():
    seen = []
    tasks = [asyncio.ensure_future(listen(seen)) for _ in range(int(sys.argv[3]))]
    print("ready", flush=True)
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.readline)
    print("seen", len(seen) / len(tasks))
    for task in tasks:
        task.cancel()
asyncio.run(main())
"""


def clouds(
    rounds: int, *, size: int = 10_000_000, rate: float = 5.0, count: int = 100, clients: int = 8
) -> list[Figure]:
    """Measure how long a publisher of clouds takes, for one node and for clients of a bridge."""
    figures = []
    for encoding in ENCODINGS:
        name = f"10 MB to {clients} clients as {encoding}"
        middle = Figure(f"{name}: publishing, median", "ms", {PLAIN: "about 1"})
        slow = Figure(f"{name}: publishing, p99", "ms", {PLAIN: "about 1"})
        came = Figure(f"{name}: came, of {count}", "messages", {PLAIN: "-"})
        figures += [middle, slow, came]
        for _ in range(rounds):
            for system in (PLAIN, OWN):
                times, seen = _stream(system, encoding, size, rate, count, clients)
                middle.add(system, statistics.median(times))
                slow.add(system, percentile(times, 99))
                came.add(system, seen)
    return figures


def _stream(
    system: str, encoding: str, size: int, rate: float, count: int, clients: int
) -> tuple[list[float], float]:
    network = Network()
    try:
        if system == PLAIN:
            listener = network.program(LISTENER)
        else:
            port = _bridge(network)[1]
            listener = network.program(CLIENTS, str(port), encoding, str(clients))
        talker = network.program(TALKER, str(size), str(rate), str(count))
        talker.wait_for("found", TIMEOUT)
        talker.say("go")
        times = json.loads(talker.wait_for("times", TIMEOUT).partition(" ")[2])
        listener.say("end")
        return times, float(listener.wait_for("seen", TIMEOUT).split()[1])
    finally:
        network.close()


def _bridge(network: Network) -> tuple[Program, int]:
    port = free_port()
    bridge = network.run("-m", "rosz", "bridge", "websocket", "--port", str(port))
    bridge.wait_for("started the bridge", TIMEOUT)
    return bridge, port


def idle(seconds: float) -> Figure:
    """Measure the processor time of a bridge whose one client is silent."""
    figure = Figure("idle with one client", "percent of a processor", {"-": "1 at most"})
    network = Network()
    try:
        bridge, port = _bridge(network)
        node = network.node("watcher")
        view = node.context.graph.view
        client = network.program(CLIENTS, str(port), "none", "1")
        eventually(lambda: view().subscriptions("/cloud"), "the subscription", TIMEOUT)
        time.sleep(2.0)  # what follows the start is not idling
        used = _processor_seconds(bridge)
        time.sleep(seconds)
        figure.add(figure.own, 100 * (_processor_seconds(bridge) - used) / seconds)
        client.say("end")
        eventually(lambda: not view().subscriptions("/cloud"), "the end of it", TIMEOUT)
    finally:
        network.close()
    return figure


def _processor_seconds(program: Program) -> float:
    fields = Path(f"/proc/{program.pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")
