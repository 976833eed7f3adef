"""A snapshot of the network: nodes, their topics and services, and their processes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from typing import TypeVar

import msgspec

from rosz.errors import DecodeError
from rosz.graph import View
from rosz.session import Session
from rosz.wire import (
    ProcessToken,
    Token,
    dropped_key,
    parse_process,
    parse_token,
    processes_key,
    tokens_key,
)

T = TypeVar("T")
_REPLY_TIMEOUT = 2.0
"""Seconds that a process that is stopped may delay a survey."""
_SEARCH_TIMEOUT = 8.0
"""Seconds for those that are named; on a busy machine they may not reply sooner."""
_DROPPED_TIMEOUT = 1.0


class Survey(msgspec.Struct, frozen=True):
    """The nodes of a domain and their entities.

    Attributes:
        domain: The ROS domain.
        view: Nodes and their publishers, subscriptions, services and clients.
        processes: Processes of rosz nodes by session and node id; ROS 2 nodes declare none.
        damaged: Reasons why tokens could not be read.
        dropped: Samples that publishers and subscriptions have dropped, by session and entity id.
    """

    domain: int
    view: View
    processes: dict[tuple[str, int], ProcessToken]
    damaged: tuple[str, ...] = ()
    dropped: dict[tuple[str, int], int] = {}

    def process(self, token: Token) -> ProcessToken | None:
        """Return the process of the node that a token belongs to."""
        return self.processes.get((token.zid, token.node_id))

    def address(self, token: Token) -> str:
        """Return where a node runs, as far as it is known."""
        process = self.process(token)
        return f"session {token.zid}" if process is None else process_address(process)

    def host(self, token: Token) -> str:
        """Return the host of the node that a token belongs to."""
        process = self.process(token)
        return "unknown host" if process is None else process.host

    def nodes_named(self, name: str) -> list[Token]:
        """Return one token for each node of a full name."""
        tokens = {(t.zid, t.node_id): t for t in self.view.tokens if t.node_name == name}
        return [tokens[key] for key in sorted(tokens)]


def process_address(process: ProcessToken) -> str:
    """Return the host and the id of a process."""
    return f"{process.host}, pid {process.pid}"


def take_survey(
    session: Session,
    domain: int,
    *,
    nodes: Collection[str] = (),
    processes: bool = False,
    dropped: bool = False,
    timeout: float = _REPLY_TIMEOUT,
    looks: int = 1,
) -> Survey:
    """Query the network for the nodes of a domain.

    Args:
        session: The session to query with.
        domain: The ROS domain.
        nodes: Full names to look for longer if they are not found at once.
        processes: Whether to query processes as well.
        dropped: Whether to query the counts of dropped samples as well.
        timeout: Seconds to wait for tokens, of which those that came by then count.
        looks: Number of queries that are united, each with this time limit.

    Raises:
        ClosedError: The session is closed.
        WaitTimeout: The replies do not end in time.
    """
    damaged: list[str] = []
    keys = session.live_tokens(tokens_key(domain), timeout, looks)
    tokens = list(read_keys(keys, parse_token, damaged))
    if nodes and not {token.node_name for token in tokens}.issuperset(nodes):
        damaged.clear()
        keys = session.live_tokens(tokens_key(domain), _SEARCH_TIMEOUT)
        tokens = list(read_keys(keys, parse_token, damaged))
    by_node: dict[tuple[str, int], ProcessToken] = {}
    if processes:
        keys = session.live_tokens(processes_key(domain), timeout, looks)
        by_node = {
            (process.zid, process.node_id): process
            for process in read_keys(keys, parse_process, damaged)
        }
    counts = dict(_read_dropped(session, domain, damaged)) if dropped else {}
    return Survey(domain, View(tokens), by_node, tuple(damaged), counts)


def _read_dropped(
    session: Session, domain: int, damaged: list[str]
) -> Iterator[tuple[tuple[str, int], int]]:
    for reply in session.get(dropped_key(domain), timeout=_DROPPED_TIMEOUT):
        if not reply.ok:  # somebody is stopped
            continue
        zid = reply.key.rpartition("/")[2]
        try:
            counts = msgspec.msgpack.decode(reply.payload, type=dict[int, int])
        except msgspec.DecodeError as error:
            damaged.append(f"what '{zid}' has dropped: {error}")
            continue
        for entity_id, count in counts.items():
            yield (zid, entity_id), count


def read_keys(keys: Iterable[str], parse: Callable[[str], T], damaged: list[str]) -> Iterator[T]:
    """Yield what keys say; those that cannot be parsed are left out, and the reasons added."""
    for key in keys:
        try:
            yield parse(key)
        except DecodeError as error:
            damaged.append(str(error))
