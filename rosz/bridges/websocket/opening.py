"""Opening a bridge by settings, as a command line or the parameters of a node give them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosz.bridges.opening import BridgeSettings, entrance
from rosz.bridges.websocket.plain import Spelling
from rosz.bridges.websocket.server import PORT, Limits, WebsocketBridge

if TYPE_CHECKING:
    from rosz.node import Node

__all__ = ("HOLDER", "Settings", "open_bridge")

HOLDER = "websocket"
"""Name of the clients in the rules of a machine."""


class Settings(BridgeSettings, frozen=True, kw_only=True):
    """Settings of a bridge.

    Attributes:
        spelling: Whose names a client gets that has not shown its own.
        fragment_size: Largest number of characters of a text that clients get whole; None for any.
    """

    port: int = PORT
    spelling: Spelling = "ros1"
    fragment_size: int | None = None


def open_bridge(node: Node, settings: Settings) -> tuple[WebsocketBridge, list[str]]:
    """Return a bridge, and lines that say where it is.

    Args:
        node: Node of the bridge.
        settings: The settings.

    Raises:
        TransportError: It cannot listen there.
        UsageError: A setting is not valid, or the library is not installed.
    """
    conditions = entrance(node, settings, HOLDER)
    bridge = WebsocketBridge(
        node,
        settings.port,
        entrance=conditions,
        spelling=settings.spelling,
        limits=Limits(fragment_size=settings.fragment_size),
    )
    return bridge, conditions.describe("rosbridge clients connect", bridge.port)
