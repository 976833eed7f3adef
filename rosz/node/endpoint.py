"""What publishers, subscriptions, services and clients have in common: a key, a token, an end."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Self

import msgspec

from rosz import names
from rosz.errors import ClosedError, UsageError
from rosz.wire import NO_HASH, Kind, Token, endpoint_key, format_token, gid

if TYPE_CHECKING:
    from types import TracebackType

    from rosz.lifecycle import Closable
    from rosz.node.node import Node
    from rosz.qos import QoS

__all__ = ("OPPOSITE", "Endpoint", "Withdrawal", "definite")

_SYSTEM_DEPTH = 42
"""Samples that rmw keeps where that is left to the system."""

_DEEPEST = (1 << 63) - 1
"""Samples beyond which others cannot count."""

OPPOSITE = {
    Kind.PUBLISHER: Kind.SUBSCRIPTION,
    Kind.SUBSCRIPTION: Kind.PUBLISHER,
    Kind.SERVICE: Kind.CLIENT,
    Kind.CLIENT: Kind.SERVICE,
}
"""What each kind of endpoint talks with."""


def definite(qos: QoS) -> QoS:
    """Return a quality of service with a depth that all others can count to.

    Raises:
        UsageError: The depth is below 0, which leaves it to the system.
    """
    if qos.depth < 0:
        raise UsageError(f"depth is {qos.depth}: expected 1 or more, or 0 for the system's choice")
    depth = min(qos.depth or _SYSTEM_DEPTH, _DEEPEST)
    return qos if depth == qos.depth else msgspec.structs.replace(qos, depth=depth)


class Withdrawal:
    """A function that takes something back, as a thing that can be closed.

    Args:
        withdraw: The function; it may be called again.
    """

    def __init__(self, withdraw: Callable[[], object]) -> None:
        self._withdraw = withdraw

    def close(self) -> None:
        """Take it back."""
        self._withdraw()


class Endpoint:
    """One end of a topic or service on a node.

    Args:
        node: The node that it belongs to.
        kind: What it is.
        name: Resolved name.
        type_name: ``pkg/msg/Name`` or ``pkg/srv/Name``.
        type_hash: ``RIHS01_…``.
        qos: What it promises or asks for.

    Attributes:
        key: Key expression that its data travels on.
        token: How it is known to others.
        gid: 16 bytes that identify it.
        closed: Whether it has been closed.

    Raises:
        InvalidName: The name is that of the root.
        UsageError: The depth of the queue means nothing.
        ClosedError: The node or its context is closed.
    """

    def __init__(
        self, node: Node, kind: Kind, name: str, type_name: str, type_hash: str, qos: QoS
    ) -> None:
        context = node.context
        self.node = node
        self.name = name
        self.qos = qos = definite(qos)
        wire_hash = NO_HASH if context.environment.distro == "humble" else type_hash
        self.key = endpoint_key(context.domain, names.check_resource(name), type_name, wire_hash)
        self.token = Token(
            domain=context.domain,
            zid=context.session.zid,
            node_id=node.node_id,
            entity_id=context.next_id(),
            kind=kind,
            namespace=node.namespace,
            node=node.base_name,
            name=name,
            type_name=type_name,
            type_hash=wire_hash,
            qos=qos,
        )
        text = format_token(self.token)
        self.gid = gid(text)
        self._token_key = text
        self._declared: list[Closable] = []
        self._closing = threading.RLock()  # a signal handler may come in between
        self._why_closed = ""
        self.closed = False

    def announce(self, *, watch: bool = True) -> None:
        """Make the endpoint known; what it needs must be declared before, so that others find it.

        Args:
            watch: Whether to tell of endpoints of the same name that it does not reach.

        Raises:
            ClosedError: The session is closed.
        """
        context = self.node.context
        if context.leave and (objection := context.leave.objection(self.token.kind, self.name)):
            self.node.log.warning("%s", objection)
        context.add_endpoint(self, watch=watch)
        self._declared.append(context.session.token(self._token_key))

    def also_close(self, part: Closable) -> None:
        """Have something closed together with the endpoint.

        Raises:
            ClosedError: It is closed; the part is, too, now.
        """
        with self._closing:
            if not self.closed:
                self._declared.append(part)
                return
        part.close()
        self.ensure_open("declare more on")

    def matches(self, token: Token) -> bool:
        """Tell whether this endpoint and another one reach each other."""
        return (
            token.kind is OPPOSITE[self.token.kind]
            and token.name == self.name
            and token.type_name == self.token.type_name
            and token.type_hash == self.token.type_hash
        )

    def ensure_open(self, doing: str) -> None:
        """Refuse a thing on a closed endpoint.

        Args:
            doing: What was wanted, such as ``publish on``.

        Raises:
            ClosedError: It is closed.
        """
        if self.closed:
            why = self._why_closed or f"the {type(self).__name__.lower()} is closed"
            raise ClosedError(f"cannot {doing} '{self.name}': {why}")

    def close(self) -> None:
        """Undeclare it, its token first; from any thread, again is no error."""
        with self._closing:
            if self.closed:
                return
            self.closed = True
        try:
            self._finish()
        finally:  # also where Ctrl-C interrupts it
            context = self.node.context
            context.remove_endpoint(self)
            if not context.session.closed:
                for declared in reversed(self._declared):
                    declared.close()
            self.node.forget(self)

    def disown(self, reason: str) -> None:
        """Refuse everything from now on, touching neither threads nor links: after a fork.

        Args:
            reason: What the refusals say.
        """
        self._why_closed = reason
        self._closing = threading.RLock()
        self.closed = True

    def _finish(self) -> None:
        """End what the endpoint runs, before it is undeclared."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        state = " closed" if self.closed else ""
        return f"<{type(self).__name__} {self.name} [{self.token.type_name}]{state}>"
