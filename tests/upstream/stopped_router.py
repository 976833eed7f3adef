"""A router of Zenoh that was stopped for longer than its lease stays half blind.

Seen with eclipse-zenoh 1.10.2. Run as ``python tests/upstream/stopped_router.py ROUNDS TOPOLOGY``;
it needs that package alone, and loopback ports 19501 to 19503.

Three routers dial each other, as a ``mesh`` or as a ``chain`` (a - b - c). Each declares three
liveliness tokens, a subscriber, and a publisher that puts five times a second. One of them is
stopped (SIGSTOP) for 12 s, with a lease of 8 s, and goes on. In most rounds, 40 s later, one router
still lacks the tokens of another, or hears its publisher no more, in one direction. The routers log
``Received LinkState from … with unknown node mapping``, ``Cannot find local psid for context``, and
``Received router declaration with unknown routing context id``.

The cause, as far as the source tells: when a router is dialled by one that it still has a link of,
the face of the new link is registered before the face of the old one is closed. The network of
routers then has two links of one id (`Network::links`). `convert_to_local_link_states` looks for
the link by that id and finds the old one, and keeps the mappings of the sender there, while
declarations are resolved with the mappings of the new one (`get_link(link_id)`), which stay empty.
`remove_link` removes all links of the id, thus also the new one. Peers and clients in place of the
stopped router do not have this, as they take no part in the network of routers, nor has a router
whose process begins anew, with a new id.
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
from typing import Any

import zenoh

_STOPPED = 12.0
_PATIENCE = 40.0
_NAMES = ("a", "b", "c")
_NEIGHBOURS = {
    "mesh": {"a": "bc", "b": "ac", "c": "ab"},
    "chain": {"a": "b", "b": "ac", "c": "b"},
}


def _endpoint(name: str) -> str:
    return f"tcp/127.0.0.1:{19501 + _NAMES.index(name)}"


def router(name: str, neighbours: str) -> None:
    """Run one router; each line on stdin asks for the names that it sees and hears."""
    config = zenoh.Config()
    for key, value in {
        "mode": "router",
        "listen/endpoints": [_endpoint(name)],
        "connect/endpoints": [_endpoint(other) for other in neighbours],
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
        "connect/retry": {"period_init_ms": 200, "period_max_ms": 200},
        "scouting/multicast/enabled": False,
        "transport/link/tx/lease": 8000,
    }.items():
        config.insert_json5(key, json.dumps(value))
    session: Any = zenoh.open(config)
    heard: dict[str, float] = {}
    tokens = [session.liveliness().declare_token(f"t/{name}/{number}") for number in range(3)]
    subscriber = session.declare_subscriber(
        "x/*", lambda sample: heard.update({str(sample.key_expr): time.monotonic()})
    )
    publisher = session.declare_publisher(f"x/{name}")

    def publish() -> None:
        while True:
            publisher.put(b"1")
            time.sleep(0.2)

    threading.Thread(target=publish, daemon=True).start()
    print("up", flush=True)
    for _ in sys.stdin:
        found = session.liveliness().get("t/**", timeout=3)
        seen = sorted({str(reply.ok.key_expr).split("/")[1] for reply in found if reply.ok})
        now = time.monotonic()
        hears = sorted(key[2:] for key, at in heard.items() if now - at < 2)
        print(json.dumps([seen, hears]), flush=True)
    del tokens, subscriber


def _ask(process: subprocess.Popen[str]) -> Any:
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write("\n")
    process.stdin.flush()
    if not select.select([process.stdout], [], [], 10)[0]:
        return "silent"
    return json.loads(process.stdout.readline() or '"ended"')


def _until_whole(processes: dict[str, subprocess.Popen[str]], timeout: float) -> dict[str, Any]:
    """Return what each one sees and hears, if that is not everything after a time."""
    deadline = time.monotonic() + timeout
    while True:
        views = {name: _ask(process) for name, process in processes.items()}
        if all(view == [list(_NAMES)] * 2 for view in views.values()):
            return {}
        if time.monotonic() > deadline:
            return views
        time.sleep(0.2)


def play(topology: str, stopped: str) -> dict[str, Any]:
    """Play one round; return what each router sees and hears if that is not everything."""
    processes = {
        name: subprocess.Popen(
            [sys.executable, __file__, "router", name, neighbours],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for name, neighbours in _NEIGHBOURS[topology].items()
    }
    try:
        for process in processes.values():
            assert process.stdout is not None
            process.stdout.readline()
        if views := _until_whole(processes, _PATIENCE):
            return {"before": views}
        os.kill(processes[stopped].pid, signal.SIGSTOP)
        time.sleep(_STOPPED)
        os.kill(processes[stopped].pid, signal.SIGCONT)
        time.sleep(2)  # links are made again, and nobody hears what was sent before
        return _until_whole(processes, _PATIENCE)
    finally:
        for process in processes.values():
            process.kill()
            process.wait()


def main() -> None:
    """Play some rounds, and print what became of each."""
    if sys.argv[1:2] == ["router"]:
        router(*sys.argv[2:])
        return
    rounds, topology = int(sys.argv[1]), sys.argv[2]
    bad = 0
    for number in range(rounds):
        stopped = "b" if topology == "chain" else _NAMES[number % 3]
        views = play(topology, stopped)
        bad += bool(views)
        print(f"{number}: {stopped} stopped:", json.dumps(views) if views else "whole", flush=True)
    print(f"{bad} of {rounds} rounds left a router half blind")


if __name__ == "__main__":
    main()
