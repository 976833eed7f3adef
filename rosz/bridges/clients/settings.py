"""Settings that all bridges for clients share."""

from __future__ import annotations

import msgspec

from rosz.access import AccessPolicy, NamePattern, ServerAccess, ServerSettings, open_access
from rosz.errors import UsageError
from rosz.node import Node


class ClientLimits(msgspec.Struct, frozen=True, kw_only=True):
    """Limits on the number of clients and on messages that wait for them.

    Attributes:
        clients: Largest number of clients.
        waiting: Bytes that wait for a client; the oldest messages give way to newer ones.
        subscriptions: Largest number of topics that one client subscribes to.
        advertisements: Largest number of topics that one client publishes.
        services: Largest number of services and of actions that one client serves.
        calls: Largest number of calls and goals of one client that have not ended.
    """

    clients: int = 500
    waiting: int = 16 << 20
    subscriptions: int = 500
    advertisements: int = 500
    services: int = 200
    calls: int = 1000

    def check(self, kind: str, number: int) -> None:
        """Refuse one more of what a client has.

        Args:
            kind: ``subscriptions``, ``advertisements``, ``services`` or ``calls``.
            number: How many it has already.

        Raises:
            UsageError: These are as many as one client may have.
        """
        most = getattr(self, kind)
        if number >= most:
            raise UsageError(f"this client has {number} {kind}, which is the limit")


class BridgeSettings(ServerSettings, frozen=True, kw_only=True):
    """Settings of a bridge.

    Attributes:
        authenticate: Whether clients need a password also on this machine.
        origins: Origins of pages that may connect without a password.
        topics: Patterns of the topics that clients see.
        services: Patterns of the services.
        params: Patterns of the parameters.
        published: Patterns of the topics that clients publish.
    """

    authenticate: bool = False
    origins: tuple[str, ...] = ()
    topics: tuple[NamePattern, ...] = ()
    services: tuple[NamePattern, ...] = ()
    params: tuple[NamePattern, ...] = ()
    published: tuple[NamePattern, ...] = ()

    def open_access(self, node: Node, holder: str, origins: tuple[str, ...] = ()) -> ServerAccess:
        """Return the access that the settings and the keys of the machine grant.

        Args:
            node: Node of the bridge.
            holder: Name of the clients in the rules of the machine.
            origins: Origins of pages that may connect always.

        Raises:
            UsageError: A setting is not valid.
        """
        policy = AccessPolicy(
            topics=self.topics,
            services=self.services,
            params=self.params,
            published=self.published,
            origins=(*origins, *self.origins),
        )
        return open_access(node, self, holder, policy, authenticate=self.authenticate)
