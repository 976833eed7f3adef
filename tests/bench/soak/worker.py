"""A part of the soak, which ends with its stdin.

``worker.py stay`` is a node that stays, and tells its memory when asked. ``worker.py come
PER_SECOND`` makes nodes, each with a session of its own as if in another process, one after the
other. ``worker.py router ENDPOINT`` is a router of Zenoh alone.
"""

from __future__ import annotations

import gc
import json
import sys
import threading
import time

import zenoh

import rosz
from rosz.msgs.std_msgs.msg import String

LIFE = 0.5
"""Part of its second that each node is there."""


def stay() -> None:
    """Publish and subscribe until the end of stdin; tell what Python holds at each line of it."""
    node = rosz.Node("stays", handle_signals=False)
    chatter = node.publisher("chatter", String)
    node.subscription("chatter", String, lambda _: None)
    node.timer(0.1, lambda _: chatter.publish(String(data="here")))
    print("ready", flush=True)
    for _ in sys.stdin:
        gc.collect()
        print(len(gc.get_objects()), flush=True)
    node.close()


def come(per_second: float) -> None:
    """Make nodes until the end of stdin."""
    ended = threading.Event()

    def wait_for_end() -> None:
        sys.stdin.read()
        ended.set()

    threading.Thread(target=wait_for_end, daemon=True).start()
    period = 1 / per_second
    due = time.monotonic()
    count = 0
    while not ended.is_set():
        count += 1
        with rosz.Node(f"comes_{count}", handle_signals=False) as node:
            node.publisher("chatter", String).publish(String(data="new"))
            node.subscription("chatter", String, lambda _: None)
            ended.wait(period * LIFE)
        print(count, flush=True)
        due = max(due + period, time.monotonic())
        ended.wait(due - time.monotonic())


def route(endpoint: str) -> None:
    """Route what nodes send until the end of stdin."""
    settings = {
        "mode": "router",
        "listen": {"endpoints": [endpoint]},
        "scouting": {"multicast": {"enabled": False}},
    }
    with zenoh.open(zenoh.Config.from_json5(json.dumps(settings))):
        print("ready", flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    match sys.argv[1]:
        case "stay":
            stay()
        case "come":
            come(float(sys.argv[2]))
        case "router":
            route(sys.argv[2])
