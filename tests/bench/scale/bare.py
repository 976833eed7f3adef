"""One client of a crowd with nothing but Zenoh: ``bare.py NUMBER COUNT``; ``bare.py router``.

It declares as many tokens as a node of rosz and follows as many key expressions, publishes one
topic, and tells when it first hears that of its neighbour. It ends with its standard input.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from typing import Any

import zenoh

TOKENS = 12
KEYS = 36
PERIOD = 0.1


def tell(word: str, value: float) -> None:
    """Say something on the pipe that all write to: whole lines, which do not mix."""
    os.write(1, f"{word} {value}\n".encode())


def ignore(_sample: zenoh.Sample) -> None:
    """Take a token and do nothing."""


def open_session(mode: str) -> Any:
    """Open the session of a client, or of the router, at the rendezvous."""
    meeting = {"endpoints": [os.environ.get("ROSZ_RENDEZVOUS", "tcp/localhost:7447")]}
    timeouts = {"open_timeout": 60_000, "accept_timeout": 60_000, "accept_pending": 1000}
    settings = {
        "mode": mode,
        "listen": meeting if mode == "router" else {},
        "connect": {} if mode == "router" else meeting | {"timeout_ms": 60_000},
        "scouting": {"multicast": {"enabled": False}},
        "transport": {"unicast": timeouts | {"max_sessions": 10_000}},
    }
    return zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))


def main() -> None:
    if sys.argv[1] == "router":
        session = open_session("router")
        tell("started", 0)
        sys.stdin.read()
        session.close()
        return
    number, count = int(sys.argv[1]), int(sys.argv[2])
    session = open_session("client")
    heard = threading.Event()

    def hear(_sample: zenoh.Sample) -> None:
        if not heard.is_set():
            heard.set()
            tell("complete", time.monotonic())

    kept: list[object] = [
        session.liveliness().declare_subscriber(
            f"@bare/0/*/*/*/MP/*/*/*/n{(number + 1) % count}k{key}/**", ignore, history=True
        )
        for key in range(KEYS)
    ]
    kept.append(session.declare_subscriber(f"bare/t{(number + 1) % count}", hear))
    own_space = f"@bare/0/{session.zid()}/0"
    kept += [
        session.liveliness().declare_token(f"{own_space}/{key}/MP/%/%/n/n{number}k{key}/t")
        for key in range(TOKENS)
    ]
    own = session.declare_publisher(f"bare/t{number}")
    stop = threading.Event()

    def publish() -> None:
        while not stop.wait(PERIOD):
            own.put(b"here")

    thread = threading.Thread(target=publish)
    thread.start()
    sys.stdin.read()
    stop.set()
    thread.join()
    session.close()
    del kept


if __name__ == "__main__":
    main()
