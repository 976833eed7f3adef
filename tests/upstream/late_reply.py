"""A session of Zenoh keeps a token for ever of which a liveliness query was told after its end.

Seen with eclipse-zenoh 1.10.2. Run as ``python tests/upstream/late_reply.py``; it needs that
package alone, and loopback port 19508.

Queries with a time limit that is too short, then the token is undeclared: each subscriber that asks
for the history is told that the token exists, though a query does not find it. On a busy machine
this happens without time limits, to one query in a hundred: the thread that begins the query sends
the tokens that the session knows after it let go of the tables, and meanwhile another thread may
handle the end of the query, which came from the router.

The cause, as the source tells: if there is no query of the interest id any more, the session
(``DeclareToken`` in api/session.rs) adds the token to ``remote_tokens``, with the id 0 that replies
have, and nobody ever undeclares it.
"""

from __future__ import annotations

import json
import time
from typing import Any

import zenoh

_ROUTER = "tcp/127.0.0.1:19508"


def _open(mode: str, **endpoints: list[str]) -> Any:
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("scouting/multicast/enabled", "false")
    for way, places in endpoints.items():
        config.insert_json5(f"{way}/endpoints", json.dumps(places))
    return zenoh.open(config)


def main() -> None:
    """Print what a subscriber is told, and what a query finds."""
    router = _open("router", listen=[_ROUTER])
    watcher, other = (_open("client", connect=[_ROUTER]) for _ in range(2))
    token = other.liveliness().declare_token("k/1")
    time.sleep(1)
    for _ in range(100):
        list(watcher.liveliness().get("k/*", timeout=1e-6))
    time.sleep(1)
    token.undeclare()
    time.sleep(1)
    events: list[str] = []
    watch = watcher.liveliness().declare_subscriber(
        "k/*", lambda sample: events.append(str(sample.kind)), history=True
    )
    time.sleep(1)
    tokens = [str(reply.ok.key_expr) for reply in watcher.liveliness().get("k/*") if reply.ok]
    print("events:", events, "expected: none; a query finds", tokens)
    del watch
    for session in (watcher, other, router):
        session.close()


if __name__ == "__main__":
    main()
