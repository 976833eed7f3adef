"""Who is there at this moment: nodes, what they offer, and the processes behind them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

import msgspec

from rosz.errors import DecodeError
from rosz.graph import View
from rosz.session import Session
from rosz.wire import (
    ProcessToken,
    Token,
    parse_process,
    parse_token,
    processes_key,
    tokens_key,
)

__all__ = ("Survey", "place", "ros1_type", "take")

T = TypeVar("T")
_ANSWER_SECONDS = 2.0


class Survey(msgspec.Struct, frozen=True):
    """What was found.

    Attributes:
        domain: The ROS domain.
        view: Nodes and endpoints.
        processes: The processes of rosz nodes by session and number; ROS 2 tells none.
        damaged: What was wrong with tokens that could not be read.
    """

    domain: int
    view: View
    processes: dict[tuple[str, int], ProcessToken]
    damaged: tuple[str, ...] = ()

    def process(self, token: Token) -> ProcessToken | None:
        """Return the process of the node that a token belongs to."""
        return self.processes.get((token.zid, token.node_id))

    def address(self, token: Token) -> str:
        """Say where a node is, as far as it tells."""
        process = self.process(token)
        return f"session {token.zid}" if process is None else place(process)

    def host(self, token: Token) -> str:
        """Return the host of the node that a token belongs to."""
        process = self.process(token)
        return "unknown host" if process is None else process.host

    def members(self, node: str) -> list[Token]:
        """Return one token for every node of that full name, endpoints aside."""
        found = {(t.zid, t.node_id): t for t in self.view.tokens if t.node_name == node}
        return [found[key] for key in sorted(found)]


def place(process: ProcessToken) -> str:
    """Say where a process is."""
    return f"{process.host}, pid {process.pid}"


def take(session: Session, domain: int, *, processes: bool = False) -> Survey:
    """Ask the network who is there.

    Args:
        session: Where to ask.
        domain: The ROS domain.
        processes: Whether to ask for processes as well.

    Raises:
        ClosedError: The session is closed.
        WaitTimeout: There was no end of answers.
    """
    damaged: list[str] = []
    keys = session.live_tokens(tokens_key(domain), _ANSWER_SECONDS)
    tokens = list(_read(keys, parse_token, damaged))
    found: dict[tuple[str, int], ProcessToken] = {}
    if processes:
        keys = session.live_tokens(processes_key(domain), _ANSWER_SECONDS)
        found = {(one.zid, one.node_id): one for one in _read(keys, parse_process, damaged)}
    return Survey(domain, View(tokens), found, tuple(damaged))


def _read(keys: Iterable[str], parse: Callable[[str], T], damaged: list[str]) -> Iterator[T]:
    for key in keys:
        try:
            yield parse(key)
        except DecodeError as error:
            damaged.append(str(error))


def ros1_type(name: str) -> str:
    """Spell a full type name as ROS 1 does: ``std_msgs/msg/String`` is ``std_msgs/String``."""
    package, _, rest = name.partition("/")
    return f"{package}/{rest.rpartition('/')[2]}"
