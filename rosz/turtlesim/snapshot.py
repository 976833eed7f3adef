"""Pictures over the network: a simulator serves them, a command fetches one.

They use a key of rosz's own, so that the topics and services are the same as in ROS 1.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import msgspec

from rosz.errors import NotFoundError, RoszError, TransportError, UsageError, WaitTimeout, near_miss
from rosz.wire import own_key
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.session import Query, Session

_TIMEOUT = 5.0


class Snapshot(msgspec.Struct, frozen=True):
    """A picture of a simulation.

    Attributes:
        node: Full name of the simulator's node.
        png: Picture as PNG.
    """

    node: str
    png: bytes


def serve(node: Node, take: Callable[[], Snapshot]) -> None:
    """Serve pictures until a node is closed.

    Args:
        node: Node of the simulator.
        take: Function that takes a picture; called on a thread of its own.
    """
    context = node.context
    key = own_key(context.domain, "picture", context.session.zid, str(node.node_id))

    def reply(query: Query) -> None:
        with query:
            try:
                query.reply(key, msgspec.msgpack.encode(take()))
            except TransportError as error:
                node.log.warning("cannot send a picture: %s", error)

    worker: Worker[Query] = node.keep(Worker(f"rosz-picture{node.name}", reply))
    node.keep(context.session.queryable(key, worker.submit))


def fetch(session: Session, domain: int, node: str = "") -> Snapshot:
    """Fetch a picture from a running simulator.

    Args:
        session: Session to use.
        domain: ROS domain.
        node: Full name of the simulator's node; may be empty if there is only one.

    Raises:
        NotFoundError: There is no simulator, or none of that name.
        UsageError: There are several, and no name is given.
        WaitTimeout: A simulator runs, but did not respond in time.
        RoszError: A reply is damaged.
    """
    replies = session.get(own_key(domain, "picture", "*", "*"), timeout=_TIMEOUT)
    try:
        pictures = [msgspec.msgpack.decode(r.payload, type=Snapshot) for r in replies if r.ok]
    except msgspec.DecodeError as error:
        raise RoszError(f"a picture came damaged: {error}") from error
    names = sorted(picture.node for picture in pictures)
    if node:
        pictures = [picture for picture in pictures if picture.node == node]
    if replies and not names:
        raise WaitTimeout("picture", _TIMEOUT, "a turtlesim runs, but does not respond")
    if not names:
        raise NotFoundError("no turtlesim is running: start 'rosz run turtlesim turtlesim_node'")
    if not pictures:
        hint = near_miss(node, names) or f"; running: {', '.join(names)}"
        raise NotFoundError(f"no turtlesim runs as '{node}'{hint}")
    if len(pictures) > 1 and not node:
        raise UsageError(f"several turtlesims are running: name one by --node: {', '.join(names)}")
    return pictures[0]
