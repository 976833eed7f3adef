"""One client of a crowd with nothing but Zenoh: ``bare.py NUMBER COUNT 1``; ``bare.py router``.

It declares as many tokens as a node of rosz and follows as many key expressions, publishes one
topic, and tells when it first hears that of its neighbour, and the processor time that each step
took until then. It ends with its standard input.
"""

from __future__ import annotations

import time

python = time.process_time()

# ruff: noqa: E402  # the time of the imports is measured
import json
import os
import sys
import threading
from typing import Any

import zenoh

imports = time.process_time()

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
    marks = [0.0, python, imports, time.process_time()]
    declared, heard = threading.Event(), threading.Event()

    def hear(_sample: zenoh.Sample) -> None:
        if not heard.is_set():
            heard.set()
            tell("complete", time.monotonic())
            declared.wait()
            steps = ("python", "imports", "session", "declares", "discovery")
            for step, begin, end in zip(
                steps, marks, [*marks[1:], time.process_time()], strict=True
            ):
                tell(step, end - begin)

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
    marks.append(time.process_time())
    declared.set()
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
