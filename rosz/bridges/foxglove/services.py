"""Services that clients call; the bridge has one client of each, which they share."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from rosz.bridges.foxglove.catalog import Channel

if TYPE_CHECKING:
    from rosz.node import Client, Node

__all__ = ("Services",)


class Services:
    """The services that the clients of a bridge call.

    Args:
        node: The node of the bridge.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._clients: dict[str, tuple[Channel, Client]] = {}

    def call(self, channel: Channel, request: bytes) -> bytes:
        """Call a service, and return its response; both are CDR.

        Raises:
            RoszError: The bytes are not a request, or the service is not there or failed.
        """
        kind = channel.kind
        response = self._client(channel).call(kind.Request.from_cdr(request))
        data: bytes = response.to_cdr()
        return data

    def _client(self, channel: Channel) -> Client:
        """Return the client of a service; a service of another type gets a new one."""
        with self._lock:
            known = self._clients.get(channel.name)
            if known is not None and known[0] == channel:
                return known[1]
            made = self._node.client(channel.name, channel.kind)
            self._clients[channel.name] = channel, made
        if known is not None:
            known[1].close()
        return made

    def close(self) -> None:
        """End the clients of services."""
        with self._lock:
            clients = [client for _, client in self._clients.values()]
            self._clients.clear()
        for client in clients:
            client.close()
