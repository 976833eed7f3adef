"""dynamic_reconfigure: settings of a node that others change while it runs.

A server describes its settings and is called back when some change. A client reads and changes the
settings of another node. May import everything up to the fifth floor.

`PUBLIC_MODULES` are imported by name: `messages` by those who need settings as messages or
dictionaries, `setting` by those who describe one.
"""

from rosz.reconfigure.client import Client, find_servers
from rosz.reconfigure.description import Config, Description, Group
from rosz.reconfigure.files import dump, load
from rosz.reconfigure.server import ALL_LEVELS, Server
from rosz.reconfigure.setting import Choice, Setting, enumeration

PUBLIC_MODULES = ("messages", "setting")

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
