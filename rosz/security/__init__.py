"""Keys and rules: which links this machine accepts, and what each holder of a key may do.

A folder of keys makes every link beyond the machine mutual TLS. Rules beside the keys say which
names each holder of a key may publish, subscribe to, call, serve and set.

Public modules beside the names exported here, because few programs need them:
`rosz.security.authority` and `rosz.security.review`, which need the cryptography package, and
`rosz.security.handshake` and `rosz.security.watch`, which need ssl; `rosz.security.reading`, which
reads patterns of names from any YAML file.
"""

from rosz.security.access import access_control
from rosz.security.folder import CERTIFICATE, KeyFolder, LocalPermissions, read_trusted
from rosz.security.rules import Permit, Rules, read_rules

PUBLIC_MODULES = ("authority", "handshake", "reading", "review", "watch")

__all__ = (
    "CERTIFICATE",
    "KeyFolder",
    "LocalPermissions",
    "Permit",
    "Rules",
    "access_control",
    "read_rules",
    "read_trusted",
)
