"""The Foxglove protocol: Foxglove, Lichtblick and other viewers take part in the network.

``protocol`` has the messages as values. The others use sockets and nodes. Needs the
extra ``rosz[foxglove]``.
"""

from rosz.bridges.assets import SHOWN
from rosz.bridges.foxglove.client import CAPABILITIES, FoxgloveLimits
from rosz.bridges.foxglove.server import PORT, FoxgloveBridge, FoxgloveSettings, Offer, open_bridge
