"""Objects that the parts of a bridge share."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import msgspec

from rosz.bridges.ros1.codec import Codecs
from rosz.bridges.ros1.peers import Prober
from rosz.bridges.ros1.sockets import SocketLoop, log
from rosz.introspect import GATHERED, LOGS
from rosz.lifecycle import Lifecycle
from rosz.names import is_of_action
from rosz.node import Context
from rosz.qos import for_queue
from rosz.wire import Kind, Token, format_token, gid
from rosz.worker import Worker

BRIDGE = "/ros1_bridge_"
"""Beginning of the names of bridges that join a master of ROS 1.

An entity of such a name, at a master or on the network, has crossed a bridge.
No bridge takes it across again, so that rings of bridges do not pass messages round for ever.
"""

MASTER_NODE = "/ros1_master_"
"""Beginning of the names of rosz's own masters, as nodes of the network."""

MASTER = "/master"
"""The name under which a master calls nodes."""

QUEUE = 10
"""Messages of a topic that wait, where nothing else is known."""

_LOG_QUEUE = 1000
_THREADS = 16
_MAX_REQUESTS = 10_000
_MAX_IDENTITIES = 10_000


class TopicConnection(msgspec.Struct, frozen=True):
    """A connection between the bridge and a node of ROS 1 for a topic.

    Attributes:
        node: Full name of the node.
        publishes: Whether it is the node that publishes.
        bytes: Number of bytes that have crossed.
        messages: Number of messages that have crossed.
    """

    node: str
    publishes: bool
    bytes: int
    messages: int


class Identity(msgspec.Struct):
    """The numbers that a node of ROS 1, or an entity of one, keeps when it goes and comes again.

    Attributes:
        number: Number within the session.
        sequence: Sequence number of its last message: receivers know a publisher by its number, and
            take a message for a repetition whose sequence number is not higher.
        started: Time that the token of the node tells; None before its first start.
    """

    number: int
    sequence: int = 0
    started: int | None = None


class BridgeResources:
    """Objects that the parts of a bridge share.

    Args:
        context: The context, which the bridge owns.
        namespace: Namespace on the network for all names of ROS 1; empty for none.
        is_master: Whether nodes of the network are nodes of ROS 1, too, and ``/rosout`` is.

    Attributes:
        name: Full name of the bridge, as ROS 1's programs see it; empty until it listens.
        codecs: Message types on both sides.
        loop: The thread that reads from sockets.
        requests: Threads for calls that wait for other programs.
        changes: One thread, on which all declarations on the network come and go.
        prober: Checks whether nodes of ROS 1 are still there.
        gids: Ids of the publishers of this bridge.
    """

    def __init__(self, context: Context, namespace: str = "", *, is_master: bool = False) -> None:
        self.context = context
        self.name = ""
        self.namespace = namespace
        self.codecs = Codecs(context.types)
        self.loop = SocketLoop("rosz-ros1")
        self.requests: Worker[Callable[[], object]] = Worker(
            "rosz-ros1-requests", threads=_THREADS, capacity=_MAX_REQUESTS, logger=log
        )
        self.changes: Worker[Callable[[], object]] = Worker("rosz-ros1-changes", logger=log)
        self.prober = Prober(self.requests, self.changes)
        self.gids: set[bytes] = set()
        self.lifecycle = Lifecycle("the bridge to ROS 1", log=log)
        self._log_tokens: tuple[Token, ...] = _log_tokens(context) if is_master else ()
        self._is_master = is_master
        self._crossed: dict[bytes, bool] = {}
        self._standing: dict[tuple[Kind, str], str] = {}
        self._identities: dict[tuple[str, Kind, str], Identity] = {}

    def identity(self, node: str, kind: Kind, name: str = "") -> Identity:
        """Return the identity of a node or of an entity, which it had before if it was there.

        A session of Zenoh, and each that is linked to it, keeps 4 kB for each key that a token ever
        had, and for a key that comes again nothing more. Only on the thread for changes.

        Args:
            node: Name of the node in ROS 1.
            kind: NODE, or the kind of the entity, of which the node has one at a time.
            name: Name of its topic or service.
        """
        identities = self._identities
        identity = identities.pop((node, kind, name), None) or Identity(self.context.next_id())
        identities[node, kind, name] = identity
        if len(identities) > _MAX_IDENTITIES:
            del identities[next(iter(identities))]
        return identity

    def here(self, name: str) -> str:
        """Return the name on the network of a name of ROS 1."""
        return f"{self.namespace}{name}"

    def there(self, name: str) -> str | None:
        """Return the name in ROS 1 of a name on the network; None if it has none."""
        below = name.startswith(f"{self.namespace}/")
        return name[len(self.namespace) :] if below else None

    def entities(self, *kinds: Kind, name: str | None = None) -> list[Token]:
        """Return the entities that are neither those of this bridge nor of actions of ROS 2.

        Args:
            kinds: Their kinds; none for all.
            name: Name of their topic or service on the network; None for all.
        """
        own = self.context.session.zid
        tokens = self.context.graph.view().entities(*kinds, name=name)
        return [t for t in tokens if t.zid != own and not is_of_action(t.name)] + [
            t
            for t in self._log_tokens
            if (not kinds or t.kind in kinds) and (name is None or t.name == name)
        ]

    def source(self, topic: str) -> str:
        """Return the topic of ROS 1 whose messages subscribers of a topic get."""
        return LOGS if self._is_master and topic == GATHERED else topic

    def standing_for(self, kind: Kind, topic: str) -> str:
        """Return the node that ROS 1's programs see at the other end of a connection.

        A connection is for all nodes of the network that publish a topic, or subscribe to it. One
        of them stands for all, as long as it is there, so that ROS 1's tools show a node they know.

        Returns:
            Full name of the node; that of the bridge if it is none of ROS 1.
        """
        if not self._is_master:
            return self.name
        nodes = [token.node_name for token in self.entities(kind, name=topic)]
        if not nodes:
            self._standing.pop((kind, topic), None)
            return self.name
        standing = self._standing.get((kind, topic), "")
        if standing not in nodes:
            standing = LOGS if LOGS in nodes else nodes[0]
            self._standing[kind, topic] = standing
        return standing

    def has_crossed(self, publisher: bytes) -> bool:
        """Return whether a publisher, given by its id, is a bridge that joined another master."""
        if self._is_master:
            return False  # ROS 1's programs are to get them
        if publisher not in self._crossed:
            self._crossed = {
                gid(format_token(token)): token.node_name.startswith(BRIDGE)
                for token in self.entities(Kind.PUBLISHER)
            }
        return self._crossed.get(publisher, False)

    def close(self) -> None:
        """End all threads."""
        self.changes.close()
        self.requests.close(0)
        self.loop.close()


def _log_tokens(context: Context) -> tuple[Token, ...]:
    """Return the entities of the node ``/rosout`` of ROS 1's master, which are of no session.

    The node repeats the logs of all nodes on ``/rosout_agg``. It is there for programs of ROS 1
    alone: every node of the network may subscribe to ``/rosout``.
    """
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
        qos=for_queue(_LOG_QUEUE),
    )
    return (
        entity(entity_id=1, kind=Kind.SUBSCRIPTION, name=LOGS),
        entity(entity_id=2, kind=Kind.PUBLISHER, name=GATHERED),
    )
