"""A router of Zenoh drops the tokens that an old peer declared before their link came about.

Seen with routers of eclipse-zenoh 1.9.0 and 1.10.2, and peers of 1.7.2. Run as
``python tests/upstream/dropped_tokens.py OLD``, where OLD is a Python in which eclipse-zenoh 1.7.2
is installed; it needs eclipse-zenoh itself, and loopback port 19506.

A peer declares a token, then the router starts, which the peer dials; a client of the router finds
no token. When the router starts first, it finds it. The router logs ``Received token with interest
id from south-bound face. This message should only flow downstream``.

The cause, as the source tells: `token_new_face` of the peer (hat/p2p_peer/token.rs in 1.8.0)
declares its tokens with interest id 0 on each new link, to routers as well. Since 1.9,
`Face::declare_token` (dispatcher/token.rs) returns if there is such an id and the face belongs to a
southern region, as the peers of a router do.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import Any

import zenoh

_ENDPOINT = "tcp/127.0.0.1:19506"
PEER = """
import json
import sys

import zenoh

config = zenoh.Config()
for key, value in {
    "mode": "peer",
    "listen/endpoints": ["tcp/127.0.0.1:0"],
    "connect/endpoints": [sys.argv[1]],
    "connect/timeout_ms": -1,
    "connect/exit_on_failure": False,
    "connect/retry": {"period_init_ms": 200, "period_max_ms": 200},
    "scouting/multicast/enabled": False,
}.items():
    config.insert_json5(key, json.dumps(value))
session = zenoh.open(config)
zid = session.zid()
token = session.liveliness().declare_token(sys.argv[2].replace("ZID", str(zid)))
print("up", zid, flush=True)
for line in sys.stdin:
    token.undeclare()
    print("undeclared", flush=True)
"""
"""A peer that dials an endpoint, and has a token until it is told to undeclare it."""


def _open(mode: str, **endpoints: list[str]) -> Any:
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("scouting/multicast/enabled", "false")
    for way, places in endpoints.items():
        config.insert_json5(f"{way}/endpoints", json.dumps(places))
    return zenoh.open(config)


def main() -> None:
    """Print which tokens a client of the router finds, with either start order."""
    for router_first in (True, False):
        router = _open("router", listen=[_ENDPOINT]) if router_first else None
        peer = subprocess.Popen(
            [sys.argv[1], "-c", PEER, _ENDPOINT, "t/ZID"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert peer.stdout is not None
        peer.stdout.readline()
        router = router or _open("router", listen=[_ENDPOINT])
        while not router.info.peers_zid():
            time.sleep(0.1)
        time.sleep(1)
        client = _open("client", connect=[_ENDPOINT])
        tokens = [str(reply.ok.key_expr) for reply in client.liveliness().get("t/*") if reply.ok]
        print("router first:" if router_first else "peer first:", tokens, "expected: one token")
        client.close()
        router.close()
        peer.kill()
        peer.wait()


if __name__ == "__main__":
    main()
