"""Opening a bridge by settings, as a command line or the parameters of a node give them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosz.bridges.foxglove.server import PORT, FoxgloveBridge, Limits, Offer
from rosz.bridges.opening import BridgeSettings, entrance

if TYPE_CHECKING:
    from rosz.node import Node

__all__ = ("HOLDER", "Settings", "open_bridge")

HOLDER = "foxglove"
"""Name of the clients in the rules of a machine."""

_APPS = ("https://app.foxglove.dev", "https://app.foxglove.com", "file://")
"""Origins of Foxglove in a browser, and of Foxglove and Lichtblick as programs."""


class Settings(BridgeSettings, frozen=True, kw_only=True):
    """Settings of a bridge; Foxglove's own pages may always connect.

    Attributes:
        limits: Limits on the number of clients and on their messages.
        offer: What the bridge offers.
    """

    port: int = PORT
    limits: Limits = Limits()
    offer: Offer = Offer()


def open_bridge(node: Node, settings: Settings) -> tuple[FoxgloveBridge, list[str]]:
    """Return a bridge, and lines that say where it is.

    Args:
        node: Node of the bridge.
        settings: The settings.

    Raises:
        TransportError: It cannot listen there.
        UsageError: A setting is not valid, or the library is not installed.
    """
    conditions = entrance(node, settings, HOLDER, _APPS)
    bridge = FoxgloveBridge(
        node,
        settings.port,
        entrance=conditions,
        limits=settings.limits,
        offer=settings.offer,
    )
    return bridge, conditions.describe("Foxglove connects", bridge.port)
