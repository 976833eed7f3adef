"""dynamic_reconfigure: settings of a node that others change while it runs.

A server describes its settings and is called back when some change. A client reads and changes the
settings of another node. May import everything up to the fifth floor.

The public module `messages` translates settings to messages and dictionaries.
"""

from rosz.reconfigure.client import Client, find_servers
from rosz.reconfigure.description import Choice, Config, Description, Group, Setting, enumeration
from rosz.reconfigure.files import dump, load
from rosz.reconfigure.server import ALL_LEVELS, Server

PUBLIC_MODULES = ("messages",)

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
