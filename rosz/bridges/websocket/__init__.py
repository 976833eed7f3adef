"""The rosbridge protocol: web pages and other programs take part in the network by websocket.

``operations``, ``plain`` and ``outbox`` are values: what is sent, and what waits to be sent. The
others use sockets and nodes. Needs the extra ``rosz[websocket]``.
"""

from __future__ import annotations

from rosz.bridges.websocket.opening import Settings, open_bridge
from rosz.bridges.websocket.plain import Spelling
from rosz.bridges.websocket.rosapi import RosApi
from rosz.bridges.websocket.server import PORT, Limits, WebsocketBridge

__all__ = (
    "PORT",
    "Limits",
    "RosApi",
    "Settings",
    "Spelling",
    "WebsocketBridge",
    "open_bridge",
)
