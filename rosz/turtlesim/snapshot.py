"""Pictures over the network: a simulator offers them, a command fetches one.

They travel on a key of rosz's own, so that the lists of topics and services stay those of ROS 1.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

import msgspec

from rosz.errors import NotFoundError, RoszError, TransportError, UsageError, near_miss
from rosz.wire import own_key

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.session import Query, Session

__all__ = ("Picture", "fetch", "offer")

_TIMEOUT = 5.0


class Picture(msgspec.Struct, frozen=True):
    """A picture of a simulation.

    Attributes:
        node: Full name of the node that simulates.
        png: The picture.
    """

    node: str
    png: bytes


def offer(node: Node, take: Callable[[], Picture]) -> None:
    """Answer questions for a picture as long as a node lives.

    Args:
        node: Whose picture it is.
        take: Takes it; called on a thread of its own.
    """
    context = node.context
    key = _key(context.domain, context.session.zid, str(node.node_id))

    def serve(query: Query) -> None:
        with query:
            try:
                query.reply(key, msgspec.msgpack.encode(take()))
            except TransportError as error:
                node.log.warning("cannot hand a picture over: %s", error)

    def arrived(query: Query) -> None:
        threading.Thread(
            target=serve, args=(query,), name=f"rosz-picture{node.name}", daemon=True
        ).start()

    node.keep(context.session.queryable(key, arrived))


def fetch(session: Session, domain: int, node: str = "") -> Picture:
    """Ask the running simulators for a picture.

    Args:
        session: Where to ask.
        domain: The ROS domain.
        node: Full name of the one to ask; may be left out where there is only one.

    Raises:
        NotFoundError: There is no simulator, or none of that name.
        UsageError: There are several, and none is named.
        RoszError: An answer is damaged.
    """
    replies = session.get(_key(domain, "*", "*"), timeout=_TIMEOUT)
    try:
        found = [msgspec.msgpack.decode(r.payload, type=Picture) for r in replies if r.ok]
    except msgspec.DecodeError as error:
        raise RoszError(f"a picture came damaged: {error}") from error
    names = sorted(picture.node for picture in found)
    if node:
        found = [picture for picture in found if picture.node == node]
    if not names:
        raise NotFoundError("no turtlesim is running: start 'rosz run turtlesim turtlesim_node'")
    if not found:
        hint = near_miss(node, names) or f"; running: {', '.join(names)}"
        raise NotFoundError(f"no turtlesim runs as '{node}'{hint}")
    if len(found) > 1 and not node:
        raise UsageError(f"several turtlesims are running: name one by --node: {', '.join(names)}")
    return found[0]


def _key(domain: int, zid: str, node_id: str) -> str:
    return own_key(domain, "picture", zid, node_id)
