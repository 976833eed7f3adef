"""dynamic_reconfigure: settings of a node that others change while it runs.

A server describes its settings and is called back when some change; a client reads and changes
those of another node. May import everything up to `rosz.introspect`.
"""

from rosz.reconfigure.client import Client
from rosz.reconfigure.config import Config
from rosz.reconfigure.description import Description, Group
from rosz.reconfigure.saved import dump, load
from rosz.reconfigure.server import ALL_LEVELS, Server
from rosz.reconfigure.servers import find_servers
from rosz.reconfigure.setting import Choice, Setting, enumeration

__all__ = (
    "ALL_LEVELS",
    "Choice",
    "Client",
    "Config",
    "Description",
    "Group",
    "Server",
    "Setting",
    "dump",
    "enumeration",
    "find_servers",
    "load",
)
