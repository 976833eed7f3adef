"""Programs that run on the hosts of the tests."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

from network import TIMEOUT, repeats

from hosts.host import Host

__all__ = ("COUNTER", "LISTENER", "TALKER", "first_messages", "p95", "slack")

TALKER = """
import sys
import rosz
from rosz.msgs.std_msgs.msg import String
with rosz.Node(sys.argv[1] if sys.argv[1:] else "talker") as node:
    topic = sys.argv[2] if sys.argv[2:] else "chatter"
    chatter = node.publisher(topic, String, queue_size=10)
    print("talking", flush=True)
    for tick in node.rate(20):
        chatter.publish(String(data=str(tick)))
"""
"""Publishes a number on ``chatter``, or another topic, twenty times a second."""

LISTENER = """
import sys
import rosz
from rosz.msgs.std_msgs.msg import String
with rosz.Node(sys.argv[1] if sys.argv[1:] else "listener") as node:
    for message in node.subscription("chatter", String):
        print("heard", message.data, flush=True)
        if sys.argv[2:] == ["once"]:
            break
"""
"""Prints what it hears on ``chatter``."""

COUNTER = """
import sys
import rosz
with rosz.Node(sys.argv[1]) as node:
    print("ready", flush=True)
    for line in sys.stdin:
        name, _, value = line.strip().partition("=")
        if value:
            node.params.set(name, int(value))
        print(name, node.params.get(name, None), flush=True)
"""
"""Sets ``/name=7`` and gets ``/name``, as it reads them."""

_START = 0.25
"""Seconds in which a machine that is not busy starts a program with rosz; half of them will do."""


def first_messages(host: Host, **variables: str) -> list[float]:
    """Return how long a new node takes to hear something, in seconds from its start, sorted."""
    seconds = []
    for _ in range(repeats(3, 40)):
        began = time.monotonic()
        listener = host.program(LISTENER, "listener", "once", **variables)
        listener.wait_for("heard")
        seconds.append(time.monotonic() - began)
        assert listener.exit_code() == 0, listener.output
    return sorted(seconds)


def slack() -> float:
    """Return how many times as long things may take here, on a slow machine or a busy one.

    Programs that began just now are not in the average of the last minute; a machine that has only
    a share of its processors, or that others slow down from outside, is not busy by its own count.
    """
    running = int(Path("/proc/loadavg").read_text().split()[3].partition("/")[0])
    busy = 2 * max(running, *os.getloadavg()) / (os.cpu_count() or 1)
    began = time.monotonic()
    subprocess.run([sys.executable, "-c", "import rosz.node"], check=True, timeout=TIMEOUT)
    return max(1.0, busy, (time.monotonic() - began) / _START)


def p95(seconds: list[float]) -> float:
    """Return what 95 of 100 stay below."""
    return seconds[min(len(seconds) - 1, int(0.95 * len(seconds)))]
