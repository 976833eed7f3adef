"""A session of plain Zenoh that watches and talks to a network, knowing nothing of rosz."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from typing import Any

import zenoh
from network import TIMEOUT

__all__ = ("Plain", "plain_session")


class Plain:
    """A Zenoh session, and what came to it.

    Attributes:
        session: It.
    """

    def __init__(self, session: zenoh.Session) -> None:
        self.session = session
        self._kept: list[Any] = []

    def subscribe(self, key: str) -> SimpleQueue[zenoh.Sample]:
        """Return a queue of all samples of a key expression."""
        queue: SimpleQueue[zenoh.Sample] = SimpleQueue()
        self._kept.append(
            self.session.declare_subscriber(key, zenoh.handlers.Callback(queue.put, indirect=False))
        )
        return queue

    def tokens(self, key: str) -> SimpleQueue[tuple[str, bool]]:
        """Return a queue of liveliness tokens that came (true) and went (false)."""
        queue: SimpleQueue[tuple[str, bool]] = SimpleQueue()

        def changed(sample: zenoh.Sample) -> None:
            queue.put((str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT))

        self._kept.append(
            self.session.liveliness().declare_subscriber(
                key, zenoh.handlers.Callback(changed, indirect=False), history=True
            )
        )
        return queue

    def queries(self, key: str) -> SimpleQueue[zenoh.Query]:
        """Return a queue of the queries on a key, declared as complete."""
        queue: SimpleQueue[zenoh.Query] = SimpleQueue()
        self._kept.append(
            self.session.declare_queryable(
                key, zenoh.handlers.Callback(queue.put, indirect=False), complete=True
            )
        )
        return queue

    def put(self, key: str, payload: bytes, **options: Any) -> None:
        """Publish a sample, which waits for the link if that is full rather than be dropped."""
        block = zenoh.CongestionControl.BLOCK
        self.session.put(key, payload, congestion_control=block, **options)

    def token(self, key: str) -> None:
        """Declare a liveliness token."""
        self._kept.append(self.session.liveliness().declare_token(key))

    def ask(self, key: str, **options: Any) -> list[zenoh.Reply]:
        """Send a query as rmw_zenoh does, and return the replies."""
        given: dict[str, Any] = {
            "target": zenoh.QueryTarget.ALL_COMPLETE,
            "consolidation": zenoh.ConsolidationMode.NONE,
            "timeout": TIMEOUT,
        }
        return list(self.session.get(key, **(given | options)))


@contextmanager
def plain_session(rendezvous: str) -> Iterator[Plain]:
    """Open a client session to a rendezvous, with no setting of rosz."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([rendezvous]))
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as session:
        yield Plain(session)
