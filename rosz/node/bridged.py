"""Nodes of another protocol, as the network sees them."""

from __future__ import annotations

from collections.abc import Callable

from rosz import names
from rosz.node.context import Context
from rosz.node.control import serve_control
from rosz.node.core import NodeCore
from rosz.node.takeover import yield_to_newer

__all__ = ("BridgedNode",)


class BridgedNode(NodeCore):
    """A node that lives elsewhere, and whose entities a bridge declares.

    A request to shut it down, from a command or since a newer node has its name, goes to the node.

    Args:
        context: The context of the bridge.
        name: Full name.
        terminate: Function that asks the node to end, for a reason.
        number: Number of the node within the session; by default one that was never used.
        started: Time of its start that its token tells, as that of the node that had the number
            before; now by default.

    Raises:
        InvalidName: The name is not legal.
        ClosedError: The context is shut down.
    """

    def __init__(
        self,
        context: Context,
        name: str,
        terminate: Callable[[str], object],
        number: int | None = None,
        started: int | None = None,
    ) -> None:
        self._terminate = terminate
        namespace = names.namespace(name).rstrip("/") or "/"
        base = names.basename(name)
        super().__init__(base, namespace=namespace, context=context, number=number, started=started)
        serve_control(self)
        yield_to_newer(self)
        self._announce()

    def shutdown(self, reason: str = "") -> None:
        """Ask the node to end; it disappears when it has."""
        if not self._lifecycle.closing:
            self._terminate(reason)

    def close(self) -> None:
        """Take the node from the network."""
        self._end("")
