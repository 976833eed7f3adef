"""Images for a Foxglove client, and a bridge with nothing to do."""

from __future__ import annotations

import importlib.util
import os
import time
from pathlib import Path

from network import Network, Program, free_port

from ..figures import OWN, Figure  # noqa: TID252  # tests is no package

__all__ = ("idle", "images")

TIMEOUT = 120.0
SDK = "foxglove-sdk"

TALKER = """
import sys, time
from rosz.node import Node
from rosz.msgs.sensor_msgs.msg import Image
with Node("talker") as node:
    publisher = node.publisher("/image", Image, queue_size=1)
    image = Image(data=bytes(int(sys.argv[1])))
    print("ready", flush=True)
    for _ in node.rate(float(sys.argv[2])):
        publisher.publish(image)
"""
SDK_BRIDGE = """
import sys, foxglove
from foxglove import Channel, Schema
from rosz.node import Node
from rosz.msgs.sensor_msgs.msg import Image
schema = Schema(name=Image._type_name, encoding="ros2msg", data=Image._full_text.encode())
channel = Channel("/image", schema=schema, message_encoding="cdr")
server = foxglove.start_server(port=int(sys.argv[1]), message_backlog_size=3)
with Node("bridge") as node:
    node.subscription("/image", Image, channel.log, raw=True, queue_size=1)
    print("started the bridge", flush=True)
    node.spin()
"""
CLIENT = """
import asyncio, json, sys, time
import websockets
async def main():
    options = {"max_size": None, "subprotocols": ["foxglove.sdk.v1"]}
    async with websockets.connect(f"ws://127.0.0.1:{sys.argv[1]}", **options) as socket:
        times = []
        async for frame in socket:
            if isinstance(frame, bytes):
                times.append(time.perf_counter())
                if len(times) == 1:
                    print("first", flush=True)
                if times[-1] - times[0] > float(sys.argv[2]):
                    count = len(times) - 1
                    print("rate", count / (times[-1] - times[0]), count, flush=True)
                    return
            for channel in json.loads(frame).get("channels", ()) if isinstance(frame, str) else ():
                if channel["topic"] == "/image":
                    wanted = [{"id": 1, "channelId": channel["id"]}]
                    await socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
                    print("subscribed", flush=True)
asyncio.run(main())
"""


def images(
    rounds: int, *, size: int = 6_000_000, rate: float = 60.0, seconds: float = 5.0
) -> list[Figure]:
    """Measure how many images a second reach a client, and the processor time of the bridge.

    Foxglove's own library stands beside rosz if it is installed.
    """
    systems = [OWN, SDK] if importlib.util.find_spec("foxglove") else [OWN]
    came = Figure(f"6 MB images to a Foxglove client, of {rate:g}/s", "/s", {SDK: "30 at least"})
    cost = Figure("processor time of the bridge for each", "ms", {SDK: "-"})
    for _ in range(rounds):
        for system in systems:
            network = Network()
            try:
                bridge, port = _bridge(network, system)
                network.program(TALKER, str(size), str(rate)).wait_for("ready", TIMEOUT)
                client = network.program(CLIENT, str(port), str(seconds))
                client.wait_for("first", TIMEOUT)
                used = _processor_seconds(bridge)
                _, found, number = client.wait_for("rate", TIMEOUT).split()
                came.add(system, float(found))
                cost.add(system, (_processor_seconds(bridge) - used) / int(number))
            finally:
                network.close()
    return [came, cost]


def _bridge(network: Network, system: str) -> tuple[Program, int]:
    port = free_port()
    if system == SDK:
        bridge = network.program(SDK_BRIDGE, str(port))
    else:
        bridge = network.run("-m", "rosz", "bridge", "foxglove", "--port", str(port))
    bridge.wait_for("started the bridge", TIMEOUT)
    return bridge, port


def idle(seconds: float) -> Figure:
    """Measure the processor time of a bridge whose one client watches a topic that is silent."""
    figure = Figure("idle with one Foxglove client", "percent of a processor", {"-": "1 at most"})
    network = Network()
    try:
        bridge, port = _bridge(network, OWN)
        network.program(TALKER, "1", "0.0001").wait_for("ready", TIMEOUT)
        network.program(CLIENT, str(port), "1000").wait_for("subscribed", TIMEOUT)
        time.sleep(2.0)  # what follows the start is not idling
        used = _processor_seconds(bridge)
        time.sleep(seconds)
        figure.add(figure.own, 100 * (_processor_seconds(bridge) - used) / seconds)
    finally:
        network.close()
    return figure


def _processor_seconds(program: Program) -> float:
    fields = Path(f"/proc/{program.pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")
