"""What this machine may do itself, where the rules beside its keys say so.

It is other machines that refuse, each by its own rules, and silently. Where all have the same
rules, whose own name is among them can be told at once.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from rosz.security.folder import KeyFolder
from rosz.security.rules import Permit
from rosz.wire import Kind

__all__ = ("Leave",)

_VERBS: Final = {
    Kind.PUBLISHER: "publish",
    Kind.SUBSCRIPTION: "subscribe",
    Kind.CLIENT: "call",
    Kind.SERVICE: "serve",
}
_STANDARD: Final = {
    (Kind.PUBLISHER, "/rosout"),
    (Kind.PUBLISHER, "/parameter_events"),
    (Kind.SUBSCRIPTION, "/clock"),
}
"""What nodes have without being told to."""


class Leave:
    """What rules say of the machine that they lie on.

    Args:
        holder: The machine, as the rules call it.
        permit: What it may do.
        file: Where that stands.
    """

    def __init__(self, holder: str, permit: Permit, file: Path) -> None:
        self._holder = holder
        self._permit = permit
        self._file = file
        self._told = set(_STANDARD)

    @classmethod
    def find(cls, keys: KeyFolder | None, host: str) -> Leave | None:
        """Return what rules say of this machine, if they do.

        Args:
            keys: Its keys.
            host: Its name; where rules do not know that, the name of the folder is its holder's.
        """
        if keys is None or keys.rules is None or keys.rules_file is None:
            return None
        for holder in (host, keys.path.name):
            permit = keys.rules.told_of(holder)
            if permit is not None:
                return cls(holder, permit, keys.rules_file)
        return None

    def objection(self, kind: Kind, name: str) -> str:
        """Return why an endpoint is of no use beyond the machine; empty if it is, or once told.

        Args:
            kind: What it is.
            name: Its global name.
        """
        verb = _VERBS[kind]
        if (kind, name) in self._told or self._permit.allows(verb, name):
            return ""
        self._told.add((kind, name))
        return (
            f"the {kind.name.lower()} of '{name}' reaches no other machine: '{self._file}' does not"
            f" allow '{self._holder}' to {verb} it"
        )
