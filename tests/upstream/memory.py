"""Memory that Zenoh keeps for sessions that have gone: ``python -m tests.upstream.memory``.

A peer of Zenoh alone stays, with two publishers; others link to it, declare what a node of rosz
declares, under keys with their own id, close it all and go. Seen with eclipse-zenoh 1.10.2: the
heap of the one that stays grows with each of them, and goes on to. With ``--rosz`` the others are
nodes of rosz, and only the one that stays is Zenoh alone. Needs Linux with glibc.

With ``--shared KEY`` all declare one subscriber on that key instead, and nothing else. With
``memory/change`` 0.3 kB stay of each session, with ``memory/**`` 4 kB, and more with each further
declaration of the one that stays: all that Zenoh's routing knew of the session (its face). A key
expression without wildcards is mapped to a number on each link, and what hangs on it is removed
when the link closes. One with wildcards is not mapped, so that its resource, as long as another
session declares it, keeps the face of the session that has gone.
"""

from __future__ import annotations

import ctypes
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import zenoh

TOKENS = 6
QUERYABLES = 8
SUBSCRIBERS = 3
DOMAIN = "47"
NODES = ["-m", "tests.bench.soak.worker", "come", "8"]


def open_peer(way: str, endpoint: str) -> Any:
    """Open a peer that only listens, or only connects."""
    settings = {
        "mode": "peer",
        "listen": {"endpoints": []},
        "connect": {"endpoints": []},
        "scouting": {"multicast": {"enabled": False}},
        way: {"endpoints": [endpoint]},
    }
    return zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))


def come_and_go(endpoint: str, shared: str) -> None:
    """Be one session after the other; each line of stdin asks for so many."""
    for line in sys.stdin:
        for _ in range(int(line)):
            print("comes", flush=True)
            session = open_peer("connect", endpoint)
            if shared:
                session.declare_subscriber(shared, _channel()).undeclare()
                session.close()
                continue
            own = f"memory/{session.zid()}"
            declared: list[Any] = [session.declare_subscriber("memory/change", _channel())]
            declared += [session.declare_publisher(f"memory/{word}") for word in ("change", "**")]
            for number in range(TOKENS):
                declared.append(session.liveliness().declare_token(f"{own}/token/{number}"))
            for number in range(QUERYABLES):
                declared.append(session.declare_queryable(f"{own}/{number}/**", _channel()))
            for number in range(SUBSCRIBERS):
                declared.append(session.declare_subscriber(f"{own}/sample/{number}", _channel()))
            declared[1].put(b"here")
            for one in reversed(declared):
                one.undeclare()
            session.close()


def _channel() -> Any:
    return zenoh.handlers.FifoChannel(100)


def heap(folder: str) -> int:
    """Return the bytes of the heap that are in use."""
    library = ctypes.CDLL(None)
    library.fopen.restype = ctypes.c_void_p
    library.malloc_info.argtypes = [ctypes.c_int, ctypes.c_void_p]
    library.fclose.argtypes = [ctypes.c_void_p]
    report = Path(folder, "heap.xml")
    file = library.fopen(str(report).encode(), b"w")
    library.malloc_info(0, file)
    library.fclose(file)
    total = report.read_text().rpartition("</heap>")[2]
    sizes = {kind: int(size) for kind, size in re.findall(r'type="(\w+)".* size="(\d+)"', total)}
    return sizes["current"] - sizes["fast"] - sizes["rest"] + sizes["mmap"]


def main() -> None:
    """Print the heap after each round."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=50, help="in each round")
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--rosz", action="store_true", help="let nodes of rosz come and go")
    parser.add_argument("--shared", default="", metavar="KEY", help="declare only one subscriber")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="zenoh-") as folder:
        endpoint = f"unixsock-stream/{folder}/z.sock"
        session = open_peer("listen", endpoint)
        space = f"@rosz/{DOMAIN}/" if given.rosz else "memory/"
        kept: list[Any] = []
        if given.shared:
            kept.append(session.declare_subscriber(given.shared, _channel()))
        else:
            kept += [session.declare_publisher(f"{space}{word}") for word in ("change", "**")]
        others = subprocess.Popen(
            [sys.executable, *(NODES if given.rosz else [__file__, endpoint, given.shared])],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
            env={**os.environ, "ROSZ_RENDEZVOUS": endpoint, "ROS_DOMAIN_ID": DOMAIN},
        )
        assert others.stdin is not None
        assert others.stdout is not None
        found: list[int] = []
        for number in range(given.rounds):
            others.stdin.write(f"{given.sessions}\n")
            for _ in range(given.sessions):
                others.stdout.readline()
            time.sleep(0.5)  # the end of the last link is handled meanwhile
            found.append(heap(folder))
            print(
                f"{(number + 1) * given.sessions} sessions: {found[-1] / 1024:.0f} kB", flush=True
            )
        others.stdin.close()
        others.terminate()
        others.wait()
        middle = len(found) // 2
        sessions = max(1, (len(found) - 1 - middle) * given.sessions)
        print(
            f"{(found[-1] - found[middle]) / 1024 / sessions:.2f} kB for each session, later half"
        )
        del kept
        session.close()


if __name__ == "__main__":
    if sys.argv[1:2] and sys.argv[1].startswith("unixsock"):
        come_and_go(*sys.argv[1:])
    else:
        main()
