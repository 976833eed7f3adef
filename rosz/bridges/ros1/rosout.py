"""The node ``/rosout`` of ROS 1's master, which repeats the logs of all nodes on ``/rosout_agg``.

It is a node for programs of ROS 1 alone: the network needs none, because every node may subscribe
to ``/rosout`` there.
"""

from __future__ import annotations

from functools import partial

from rosz.bridges.logs import GATHERED, LOGS
from rosz.node import Context
from rosz.qos import for_queue
from rosz.wire import Kind, Token

__all__ = ("log_tokens",)

_QUEUE = 1000


def log_tokens(context: Context) -> tuple[Token, ...]:
    """Return the entities of the node, which are of no session."""
    cls = context.types.message("rcl_interfaces/Log")
    entity = partial(
        Token,
        context.domain,
        zid="",
        node_id=0,
        namespace="/",
        node=LOGS.removeprefix("/"),
        type_name=cls._type_name,
        type_hash=cls._type_hash,
        qos=for_queue(_QUEUE),
    )
    return (
        entity(entity_id=1, kind=Kind.SUBSCRIPTION, name=LOGS),
        entity(entity_id=2, kind=Kind.PUBLISHER, name=GATHERED),
    )
