"""Keys and rules: who may be linked to this machine, and what each may do.

A folder of keys makes every link beyond the machine mutual TLS; rules beside the keys say which
names each holder of a key may publish, subscribe to, call, serve and set.
"""

from rosz.security.access import access_control
from rosz.security.folder import KeyFolder
from rosz.security.leave import Leave
from rosz.security.rules import Permit, Rules, read_rules

__all__ = ("KeyFolder", "Leave", "Permit", "Rules", "access_control", "read_rules")
