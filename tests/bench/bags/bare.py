"""Messages over nothing but Zenoh: ``bare.py talker SIZE RATE COUNT``, ``bare.py receiver FILE``.

The talker prints what `talker.py` prints. The receiver copies the payload of each message, and
writes into FILE how many came when it is interrupted. ``bare.py put COUNT`` prints the seconds that
it takes to publish messages of 52 bytes that are ready to a subscriber in another process.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import zenoh

KEY = "bench"


def open_session(*, listens: bool) -> Any:
    """Open a session that meets the other one at the rendezvous."""
    meeting = {"endpoints": [os.environ["ROSZ_RENDEZVOUS"]]}
    settings = {
        "listen" if listens else "connect": meeting,
        "connect" if listens else "listen": {"endpoints": []},
        "scouting": {"multicast": {"enabled": False}},
    }
    return zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))


def make_publisher(session: Any, *, waits: bool) -> Any:
    """Declare the publisher, and wait for the subscriber."""
    control = zenoh.CongestionControl
    publisher = session.declare_publisher(
        KEY, congestion_control=control.BLOCK if waits else control.DROP
    )
    print("ready", flush=True)
    while not publisher.matching_status.matching:
        time.sleep(0.01)
    time.sleep(1)
    return publisher


def talk(size: int, rate: int, count: int) -> None:
    with open_session(listens=True) as session:
        publisher, data = make_publisher(session, waits=False), b"x" * size
        print("begin", flush=True)
        begun = time.monotonic()
        for number in range(count):
            publisher.put(data)
            ahead = begun + (number + 1) / rate - time.monotonic()
            if ahead > 0.0005:
                time.sleep(ahead)
        elapsed = time.monotonic() - begun
        time.sleep(2)
        print(json.dumps({"rate": count / elapsed}), flush=True)
        sys.stdin.readline()


def receive(file: Path) -> None:
    with open_session(listens=False) as session:
        subscriber = session.declare_subscriber(KEY, zenoh.handlers.RingChannel(256))
        found, ended = [0], threading.Event()

        def take() -> None:
            for sample in subscriber:
                sample.payload.to_bytes()
                found[0] += 1

        threading.Thread(target=take, daemon=True).start()
        signal.signal(signal.SIGINT, lambda *_: ended.set())
        ended.wait()
        file.write_text(str(found[0]))
        os._exit(0)  # the thread waits for more


def put(count: int) -> None:
    with open_session(listens=True) as session:
        command = [sys.executable, __file__, "receiver", os.devnull]
        receiver = subprocess.Popen(command)
        try:
            publisher, data = make_publisher(session, waits=True), b"x" * 52
            begun = time.perf_counter()
            for _ in range(count):
                publisher.put(data)
            print(json.dumps({"seconds": time.perf_counter() - begun}), flush=True)
        finally:
            receiver.kill()
            receiver.wait()


def main() -> None:
    kind, *words = sys.argv[1:]
    if kind == "receiver":
        receive(Path(words[0]))
    elif kind == "talker":
        talk(*map(int, words))
    else:
        put(int(words[0]))


if __name__ == "__main__":
    main()
