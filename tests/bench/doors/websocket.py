"""Clouds for eight rosbridge clients, and a bridge with nothing to do."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

from network import Network, Program, eventually, free_port

from ..clouds import CLOUD_BYTES, Copies, Listener, Readers, publishing_figures  # noqa: TID252  # no package
from ..figures import OWN, Figure  # noqa: TID252  # tests is no package

__all__ = ("clouds", "idle")

TIMEOUT = 120.0
PLAIN = "one node"
CONTROL = "copies alone"
ENCODINGS = {"cbor-raw": CLOUD_BYTES, "none": CLOUD_BYTES * 4 // 3}
"""Bytes of a cloud, by the encoding that clients ask for."""

HANDSHAKE = (
    b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)
_ROUNDS = 2
_MESSAGES = 10 * _ROUNDS

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


def clouds(rounds: int, *, clients: int = 8) -> list[Figure]:
    """Measure how long a publisher of clouds takes, for one node and for clients of a bridge.

    The control is a node that copies as many bytes to as many sockets, and nothing else.
    """
    figures = []
    for encoding, size in ENCODINGS.items():
        name = f"10 MB to {clients} clients as {encoding}"
        asked = {PLAIN: "about 1", CONTROL: "about 1"}
        came = Figure(f"{name}: came to each, of {_MESSAGES * rounds}", "messages", asked)
        network = Network()
        try:
            sinks = {
                PLAIN: Listener(network),
                CONTROL: Copies(network, clients),
                OWN: Readers(network, _bridge(network)[1], clients, _subscribing(encoding), size),
            }
            figures += publishing_figures(
                name, came, network, sinks, _ROUNDS * rounds, _MESSAGES // _ROUNDS
            )
        finally:
            network.close()
    return figures


def _subscribing(encoding: str) -> bytes:
    """Return the first bytes of a client that subscribes to clouds."""
    operation = {"op": "subscribe", "topic": "/cloud", "type": "sensor_msgs/PointCloud2"}
    text = json.dumps({**operation, "compression": encoding}).encode()
    return HANDSHAKE + b"\x81\xfe" + len(text).to_bytes(2, "big") + bytes(4) + text


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
