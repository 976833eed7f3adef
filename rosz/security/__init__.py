"""Keys and rules: which links this machine accepts, and what each holder of a key may do.

A folder of keys makes every link beyond the machine mutual TLS. Rules beside the keys say which
names each holder of a key may publish, subscribe to, call, serve and set. The names are imported
on first use: few programs need ssl, and fewer the library cryptography.
"""

from __future__ import annotations

from rosz.lazy import exports_of

TYPE_CHECKING = False  # typing takes longer to import than everything else here
if TYPE_CHECKING:
    from rosz.security.authority import Authority
    from rosz.security.folder import (
        CERTIFICATE,
        KeyFolder,
        KeyWatch,
        LocalPermissions,
        read_trusted,
    )
    from rosz.security.handshake import certificate_names, refusal, wants_keys
    from rosz.security.patterns import PatternReader, compose, is_pattern, matches
    from rosz.security.review import review_keys
    from rosz.security.rules import EVERYTHING, Permit, Rules, read_rules
    from rosz.security.zenoh_rules import access_control
else:
    __getattr__ = exports_of(__name__)
