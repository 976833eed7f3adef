"""Access: who may connect to a server for clients without keys, and what these may do.

A server is a bridge or the page. Its policy is made of its settings, and of the rules of the
machine (`rosz.security`). The package may import what a node may.
"""

from rosz.access.connecting import (
    PasswordGuesses,
    is_loopback,
    is_password,
    origin_objection,
    page_objection,
)
from rosz.access.policy import AccessPolicy, NamePattern, PagePolicy, Verb, matches_any
from rosz.access.server import ServerAccess, ServerSettings, open_access
