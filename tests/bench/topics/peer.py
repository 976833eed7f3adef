"""A process of the benchmark: ``python -m tests.bench.topics.peer SYSTEM ROLE [ARGUMENT…]``.

All systems run the same code here. A peer prints ``ready``, then its result as JSON, and ends when
its input does.
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
from typing import Any

from .systems import System, open_system

_WARM_UP = 300
_CALM = 0.3
"""Seconds for what goes on in the background after a start to come to its end."""


def say(value: object) -> None:
    print(json.dumps(value), flush=True)


def wait_for_end() -> None:
    sys.stdin.read()


def echo(system: System) -> None:
    publish = system.publisher("pong", "Twist")
    system.subscribe("ping", "Twist", publish)
    say("ready")
    wait_for_end()


def ping(system: System, count: str) -> None:
    """Tell the median seconds from publishing to the callback with what came back."""
    rounds = int(count) + _WARM_UP
    publish, message = system.publisher("ping", "Twist"), system.message("Twist")
    times: list[float] = []
    done = threading.Event()
    clock = time.perf_counter
    began = 0.0

    def back(answer: Any) -> None:
        nonlocal began
        times.append(clock() - began)
        if len(times) == rounds:
            done.set()
            return
        began = clock()
        publish(answer)

    system.subscribe("pong", "Twist", back)
    system.wait_for_subscriber()
    say("ready")
    time.sleep(_CALM)
    while not times:  # the way back may be a moment behind
        began = clock()
        publish(message)
        done.wait(0.5)
    if not done.wait(30):
        raise SystemExit(f"only {len(times)} of {rounds} came back")
    say(statistics.median(times[_WARM_UP:]))


def hear(system: System, kind: str, seconds: str) -> None:
    """Tell the messages per second that come to a callback."""
    came = threading.Event()
    heard = 0

    def count(_: Any) -> None:
        nonlocal heard
        heard += 1
        came.set()

    system.subscribe("flood", kind, count)
    say("ready")
    came.wait(30)
    time.sleep(_CALM)
    before, began = heard, time.perf_counter()
    time.sleep(float(seconds))
    say((heard - before) / (time.perf_counter() - began))
    wait_for_end()


def pour(system: System, kind: str) -> None:
    """Publish as fast as it goes."""
    publish, message = system.publisher("flood", kind), system.message(kind)
    system.wait_for_subscriber()
    say("ready")
    watch = threading.Thread(target=wait_for_end, daemon=True)
    watch.start()
    while watch.is_alive():
        for _ in range(10):
            publish(message)


def serve(system: System) -> None:
    system.serve("switch")
    say("ready")
    wait_for_end()


def call(system: System, count: str) -> None:
    """Tell the median seconds of a call."""
    once = system.client("switch")
    say("ready")
    time.sleep(_CALM)
    times = []
    for _ in range(int(count) + int(count) // 10):
        began = time.perf_counter()
        once()
        times.append(time.perf_counter() - began)
    say(statistics.median(times[int(count) // 10 :]))


def listen(system: System) -> None:
    """Tell of each message when it came, by the clock that all processes share."""
    system.subscribe("word", "Twist", lambda _: say(time.monotonic()))
    say("ready")
    wait_for_end()


def first(system: System, waits: str) -> None:
    """Say one thing and go."""
    publish = system.publisher("word", "Twist")
    if waits == "waits":
        system.wait_for_subscriber()
    publish(system.message("Twist"))
    system.close()


def tick(system: System) -> None:
    publish, message = system.publisher("word", "Twist"), system.message("Twist")
    system.every(0.01, lambda: publish(message))
    say("ready")
    _tell_usage()


def idle(system: System) -> None:
    system.publisher("nothing", "Twist")
    system.subscribe("silence", "Twist", print)
    say("ready")
    _tell_usage()


def _tell_usage() -> None:
    """Tell, for each line of input, the seconds of CPU used so far and the megabytes in memory."""
    for _ in sys.stdin:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        say([time.process_time(), pages * os.sysconf("SC_PAGE_SIZE") / 1e6])


ROLES: dict[str, Callable[..., None]] = {
    role.__name__: role for role in (echo, ping, hear, pour, serve, call, listen, first, tick, idle)
}


def main() -> None:
    system_name, role, *arguments = sys.argv[1:]
    system = open_system(system_name, role)
    ROLES[role](system, *arguments)
    if role != "first":
        os._exit(0)


if __name__ == "__main__":
    main()
