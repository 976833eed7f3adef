"""The rosbridge protocol: web pages and other programs take part in the network by websocket.

``operations`` and ``plain`` have values; the others use sockets and nodes. Needs the extra
``rosz[websocket]``.
"""

from rosz.bridges.rosbridge.plain import Spelling
from rosz.bridges.rosbridge.rosapi import RosApi
from rosz.bridges.rosbridge.server import PORT, RosbridgeSettings, WebsocketBridge, open_bridge
from rosz.bridges.rosbridge.state import RosbridgeLimits
