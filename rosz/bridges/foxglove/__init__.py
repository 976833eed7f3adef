"""The Foxglove protocol: Foxglove, Lichtblick and other viewers take part in the network.

``protocol`` has the messages as values. The others use sockets and nodes. Needs the
extra ``rosz[foxglove]``.
"""

from __future__ import annotations

from rosz.bridges.assets import SHOWN
from rosz.bridges.foxglove.client import CAPABILITIES
from rosz.bridges.foxglove.server import (
    PORT,
    FoxgloveBridge,
    FoxgloveLimits,
    FoxgloveSettings,
    Offer,
    open_bridge,
)
