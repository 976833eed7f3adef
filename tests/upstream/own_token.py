"""A session of Zenoh is told that its own liveliness token is gone while it still declares it.

Seen with eclipse-zenoh 1.10.2. Run as ``python tests/upstream/own_token.py``; it needs that package
alone, and loopback ports 19504 and 19505.

Two routers are linked; a peer of the one and a client of the other declare a token of the same key.
When the client undeclares its own, the liveliness subscriber of the peer gets a DELETE, although
the peer declares the token still, and a query finds it. The same happens without a second session
when a link is cut: a router that was away learns the peer's token from a third router first, and
takes it back when the link to that one changes.
"""

from __future__ import annotations

import json
import time
from typing import Any

import zenoh


def _open(mode: str, listen: list[str], connect: list[str]) -> Any:
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("listen/endpoints", json.dumps(listen))
    config.insert_json5("connect/endpoints", json.dumps(connect))
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


def main() -> None:
    """Print what the subscriber gets, and what a query finds."""
    near, far = "tcp/127.0.0.1:19504", "tcp/127.0.0.1:19505"
    routers = [_open("router", [near], []), _open("router", [far], [near])]
    peer = _open("peer", ["tcp/127.0.0.1:0"], [near])
    client = _open("client", [], [far])
    events: list[str] = []
    watch = peer.liveliness().declare_subscriber(
        "k/*", lambda sample: events.append(str(sample.kind)), history=True
    )
    tokens = [peer.liveliness().declare_token("k/1")]
    time.sleep(1)
    other = client.liveliness().declare_token("k/1")
    time.sleep(1)
    other.undeclare()
    time.sleep(1)
    found = [str(reply.ok.key_expr) for reply in peer.liveliness().get("k/*") if reply.ok]
    print("events:", events, "expected: one put; a query finds", found)
    del watch, tokens
    for session in (client, peer, *routers):
        session.close()


if __name__ == "__main__":
    main()
