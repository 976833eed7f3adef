"""The base class of publishers, subscriptions, services and clients: key, token, lifecycle."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import msgspec

from rosz import names
from rosz.errors import UsageError
from rosz.graph import Followed
from rosz.lifecycle import Closable, Closing, Lifecycle, Registration
from rosz.node.core import NodeCore
from rosz.node.incompatible import COUNTERPARTS, IncompatibleEntities
from rosz.qos import QoS
from rosz.wire import NO_HASH, Kind, Token, entity_key, format_token, gid

ANY = "*"
"""The type name and hash of an entity that receives every type."""

_SYSTEM_DEPTH = 42
"""Samples that rmw keeps if the depth is left to the system."""

_DEEPEST = (1 << 63) - 1
"""Samples beyond which other implementations cannot count."""

P = TypeVar("P", bound=Closable)
Introspect = Callable[[str, bytes, int, Any], object]
"""Function that gets an event of a service: its name as in `service_msgs/ServiceEventInfo`, the GID
of the client, the number of the request, and the request or response."""


class Entity(Closing):
    """A publisher, subscription, service or client of a node.

    Args:
        node: The node that the entity belongs to.
        kind: The kind of entity.
        name: Resolved name of the topic or service.
        type_name: ``pkg/msg/Name`` or ``pkg/srv/Name``, or `ANY`.
        type_hash: ``RIHS01_…``, or `ANY`.
        qos: The quality of service that it offers or asks for.
        number: Number of the entity within the session; by default one that was never used.

    Attributes:
        key: Key expression of its data.
        token: Liveliness token of the entity.
        gid: 16 bytes that identify it.

    Raises:
        InvalidName: The name is that of the root.
        UsageError: The depth of the queue is below 0.
        ClosedError: The node or its context is closed.
    """

    def __init__(
        self,
        node: NodeCore,
        kind: Kind,
        name: str,
        type_name: str,
        type_hash: str,
        qos: QoS,
        *,
        number: int | None = None,
    ) -> None:
        context = node.context
        self.node = node
        self.name = name
        qos = _with_depth(qos)
        self.qos: QoS = qos
        without_hash = context.environment.distro == "humble" and type_hash != ANY
        wire_hash = NO_HASH if without_hash else type_hash
        names.check_length(type_name)
        self.key: str = entity_key(context.domain, names.check_resource(name), type_name, wire_hash)
        self.token: Token = Token(
            domain=context.domain,
            zid=context.session.zid,
            node_id=node.node_id,
            entity_id=context.next_id() if number is None else number,
            kind=kind,
            namespace=node.namespace,
            node=node.base_name,
            name=name,
            type_name=type_name,
            type_hash=wire_hash,
            qos=qos,
        )
        self._token_key = format_token(self.token)
        self.gid: bytes = gid(self._token_key)
        what = f"the {kind.name.lower()} of '{name}'"
        self._others: Followed | None = None
        self._lifecycle = Lifecycle(what, log=node.log, on_fork=self._forked)

    @property
    def closed(self) -> bool:
        """Whether the entity has been closed, or is being closed."""
        return self._lifecycle.closing

    @property
    def others(self) -> Followed:
        """The entities of its name that it may exchange data with, followed from the first use.

        Raises:
            ClosedError: The entity or its context was closed before the first use.
        """
        if self._others is None:
            graph, kind = self.node.context.graph, COUNTERPARTS[self.token.kind]
            self._others = self.keep(graph.follow_entities(kind, self.name))
        return self._others

    def announce(self, *, watch: bool = True) -> None:
        """Make the entity known to others; declare what they need of it before.

        Args:
            watch: Whether to warn about entities of the same name that it cannot reach.

        Raises:
            ClosedError: The session is closed.
        """
        context, node = self.node.context, self.node
        rules = context.permissions
        if rules and (objection := rules.describe_objection(self.token.kind, self.name)):
            node.log.warning("%s", objection)
        if watch:
            incompatible = IncompatibleEntities(self.token, node.log)
            self.keep(Registration(self.others.listen(incompatible.changed)))
        self.keep(context.session.token(self._token_key))

    def keep(self, part: P) -> P:
        """Close something together with the entity.

        Raises:
            ClosedError: The entity is closed; the part has been closed.
        """
        return self._lifecycle.keep(part)

    def matches(self, token: Token) -> bool:
        """Return whether this entity and another one reach each other."""
        own = self.token
        return (
            token.kind is COUNTERPARTS[own.kind]
            and token.name == self.name
            and token.type_name == own.type_name
            and token.type_hash == own.type_hash
        )

    def check_open(self, doing: str) -> None:
        """Refuse an operation on a closed entity.

        Args:
            doing: The operation, such as ``publish``.

        Raises:
            ClosedError: The entity is closed.
        """
        self._lifecycle.check_open(doing)

    def close(self) -> None:
        """Undeclare the entity, its token first; a second call has no effect."""
        try:
            self._lifecycle.close(self._finish)
        finally:  # also where Ctrl-C interrupts it
            self.node.forget(self)

    def _finish(self) -> None:
        """End the work of the entity, before its parts are closed."""

    def _forked(self) -> None:
        """Replace locks in a forked child."""

    def __repr__(self) -> str:
        state = " closed" if self.closed else ""
        return f"<{type(self).__name__} {self.name} [{self.token.type_name}]{state}>"


def _with_depth(qos: QoS) -> QoS:
    """Return a quality of service with a depth that all implementations can count to."""
    if qos.depth < 0:
        raise UsageError(f"depth is {qos.depth}: expected 1 or more, or 0 for the system's choice")
    depth = min(qos.depth or _SYSTEM_DEPTH, _DEEPEST)
    return qos if depth == qos.depth else msgspec.structs.replace(qos, depth=depth)
