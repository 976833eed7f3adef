"""What the parts of a bridge share."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from rosz.bridges.ros1.codec import Codecs
from rosz.bridges.ros1.sockets import SocketLoop, log
from rosz.lifecycle import Lifecycle
from rosz.names import is_of_action
from rosz.node import Context
from rosz.wire import Token
from rosz.worker import Worker

__all__ = ("BRIDGE", "MASTER", "Shared")

BRIDGE = "/ros1_bridge_"
"""What the names of bridges begin with."""

MASTER = "/master"
"""The name under which a master calls nodes."""

_THREADS = 16
_MAX_REQUESTS = 10_000


class Shared:
    """What the parts of a bridge share.

    Args:
        context: The context, which the bridge owns.
        name: Full name of the bridge, as ROS 1's programs see it.
        namespace: Namespace on the network for all names of ROS 1; empty for none.

    Attributes:
        context: The context.
        name: Full name of the bridge.
        namespace: As given.
        codecs: Message types on both sides.
        loop: The thread that reads from sockets.
        requests: Threads for what waits for other programs.
        changes: One thread, on which all declarations on the network come and go.
        gids: Ids of the publishers of this bridge.
        lifecycle: The lifecycle of the bridge.
    """

    def __init__(self, context: Context, name: str, namespace: str = "") -> None:
        self.context = context
        self.name = name
        self.namespace = namespace
        self.codecs = Codecs(context.types)
        self.loop = SocketLoop("rosz-ros1")
        self.requests: Worker[Callable[[], object]] = Worker(
            "rosz-ros1-requests", threads=_THREADS, capacity=_MAX_REQUESTS, logger=log
        )
        self.changes: Worker[Callable[[], object]] = Worker("rosz-ros1-changes", logger=log)
        self.gids: set[bytes] = set()
        self.lifecycle = Lifecycle("the bridge to ROS 1", log=log)

    def here(self, name: str) -> str:
        """Return the name on the network of a name of ROS 1."""
        return f"{self.namespace}{name}"

    def there(self, name: str) -> str | None:
        """Return the name in ROS 1 of a name on the network; None if it has none."""
        below = name.startswith(f"{self.namespace}/")
        return name[len(self.namespace) :] if below else None

    def foreign(self, tokens: Iterable[Token]) -> list[Token]:
        """Return the entities that are neither those of this bridge nor of actions of ROS 2."""
        own = self.context.session.zid
        return [one for one in tokens if one.zid != own and not is_of_action(one.name)]

    def publishers(self, topic: str) -> list[Token]:
        """Return the publishers of a topic on the network."""
        return self.foreign(self.context.graph.view().publishers(topic))

    def subscriptions(self, topic: str) -> list[Token]:
        """Return the subscriptions of a topic on the network."""
        return self.foreign(self.context.graph.view().subscriptions(topic))

    def servers(self, service: str) -> list[Token]:
        """Return the servers of a service on the network."""
        return self.foreign(self.context.graph.view().servers(service))

    def close(self) -> None:
        """End all threads."""
        self.changes.close()
        self.requests.close(0)
        self.loop.close()
