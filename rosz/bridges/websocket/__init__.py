"""The rosbridge protocol: web pages and other programs take part in the network by websocket.

``operations``, ``plain`` and ``outbox`` are values: what is sent, and what waits to be sent. The
others use sockets and nodes. Needs the extra ``rosz[websocket]``.
"""

from __future__ import annotations

from rosz.bridges.websocket.messages import build
from rosz.bridges.websocket.opening import Settings, open_bridge
from rosz.bridges.websocket.outbox import Encodings, Feed, Message, Outbox
from rosz.bridges.websocket.plain import Spelling
from rosz.bridges.websocket.rosapi import RosApi
from rosz.bridges.websocket.server import PORT, Limits, WebsocketBridge
from rosz.bridges.websocket.topics import Topics

__all__ = (
    "PORT",
    "Encodings",
    "Feed",
    "Limits",
    "Message",
    "Outbox",
    "RosApi",
    "Settings",
    "Spelling",
    "Topics",
    "WebsocketBridge",
    "build",
    "open_bridge",
)
