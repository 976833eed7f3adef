"""The Foxglove protocol: Foxglove, Lichtblick and other viewers take part in the network.

``protocol`` is a value: what is sent and received. The others use sockets and nodes. The
publishers, subscriptions and outgoing queues are those of the rosbridge protocol. Needs the extra
``rosz[foxglove]``.
"""

from __future__ import annotations

from rosz.bridges.assets import SHOWN
from rosz.bridges.foxglove.connection import CAPABILITIES
from rosz.bridges.foxglove.opening import Settings, open_bridge
from rosz.bridges.foxglove.server import PORT, FoxgloveBridge, Limits, Offer

__all__ = (
    "CAPABILITIES",
    "PORT",
    "SHOWN",
    "FoxgloveBridge",
    "Limits",
    "Offer",
    "Settings",
    "open_bridge",
)
