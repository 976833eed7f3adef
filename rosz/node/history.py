"""What a latching publisher sent before: a subscription asks for it when they meet."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from rosz.errors import RoszError
from rosz.wire import Token, endpoint_key

if TYPE_CHECKING:
    from rosz.node.node import Node
    from rosz.session import Reply

__all__ = ("ask_for_history",)

_TIMEOUT = 10.0


def ask_for_history(
    node: Node, publisher: Token, deliver: Callable[[Reply], None], most: int | None
) -> None:
    """Have the newest samples in a publisher's cache delivered, on a Zenoh thread.

    Args:
        node: Who asks.
        publisher: A publisher that keeps samples for late joiners.
        deliver: Gets each sample.
        most: How many samples to ask for at most; as many as it keeps when not given.
    """
    if publisher.qos is None:
        return
    depth = publisher.qos.depth
    key = endpoint_key(publisher.domain, publisher.name, publisher.type_name, publisher.type_hash)
    try:
        node.context.session.get_async(
            f"{key}/@adv/pub/{publisher.zid}/**",
            lambda reply: deliver(reply) if reply.ok else None,
            lambda: None,
            timeout=_TIMEOUT,
            parameters=f"_max={depth if most is None else min(depth, most)};_anyke",
            any_key=True,
        )
    except RoszError as error:
        if not node.context.is_shutdown:
            node.log.warning(
                "no history of '%s' from node '%s': %s", publisher.name, publisher.node_name, error
            )
