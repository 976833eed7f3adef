"""What publishers, subscriptions, services and clients have in common: a key, a token, an end."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Self

from rosz.wire import NO_HASH, Kind, Token, endpoint_key, format_token, gid

if TYPE_CHECKING:
    from types import TracebackType

    from rosz.node.node import Node
    from rosz.qos import QoS
    from rosz.session import Closable

__all__ = ("Endpoint", "Withdrawal")


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
    """

    def __init__(
        self, node: Node, kind: Kind, name: str, type_name: str, type_hash: str, qos: QoS
    ) -> None:
        context = node.context
        self.node = node
        self.name = name
        self.qos = qos
        wire_hash = NO_HASH if context.environment.distro == "humble" else type_hash
        self.key = endpoint_key(context.domain, name, type_name, wire_hash)
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
        self._closing = threading.Lock()
        self.closed = False

    def _announce(self) -> None:
        """Make the endpoint known; what it needs must be declared before that."""
        self._declared.append(self.node.context.session.token(self._token_key))

    def close(self) -> None:
        """Undeclare it, its token first; from any thread, again is no error."""
        with self._closing:
            if self.closed:
                return
            self.closed = True
        self._finish()
        if not self.node.context.session.closed:
            for declared in reversed(self._declared):
                declared.close()
        self.node.forget(self)

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
