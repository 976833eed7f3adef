"""The permissions of the clients of a bridge."""

from __future__ import annotations

import fnmatch
import re
from typing import Literal, TypeAlias

import msgspec

from rosz.errors import UsageError
from rosz.security import Permit

__all__ = ("Gate", "Pattern", "Verb", "matches")

Pattern: TypeAlias = str | re.Pattern[str]
"""A name with wildcards as in a shell, or a regular expression for whole names."""

Verb: TypeAlias = Literal["publish", "subscribe", "call", "serve", "set", "get"]

_CHANGES = frozenset({"publish", "call", "serve", "set"})
_OBJECTS = {"publish": "topics", "subscribe": "topics", "call": "services", "serve": "services"}


class Gate(msgspec.Struct, frozen=True):
    """The permissions of the clients of a bridge.

    Attributes:
        permit: Permissions by the rules of the machine; None without rules.
        read_only: Whether nothing may be changed.
        topics: Patterns of the topics that clients see; all if there is none.
        services: Patterns of the services.
        params: Patterns of the parameters.
        published: Patterns of the topics that clients publish; all that they see if there is none.
    """

    permit: Permit | None = None
    read_only: bool = False
    topics: tuple[Pattern, ...] = ()
    services: tuple[Pattern, ...] = ()
    params: tuple[Pattern, ...] = ()
    published: tuple[Pattern, ...] = ()

    def objection(self, verb: Verb, name: str) -> str:
        """Return why clients may not do something; empty if they may.

        Args:
            verb: The action.
            name: Full name of the topic, service or parameter.
        """
        if self.read_only and verb in _CHANGES:
            return f"clients may not {verb} '{name}': this bridge is read-only"
        hidden = verb == "publish" and not matches(self.published, name)
        if hidden or not self.shows(_OBJECTS.get(verb, "params"), name):
            return f"clients may not {verb} '{name}': the patterns of this bridge leave it out"
        if self.permit is None:
            return ""
        allowed = self.permit.get if verb == "get" else self.permit.allows(verb, name)
        return "" if allowed else f"the rules of this machine do not let clients {verb} '{name}'"

    def check(self, verb: Verb, name: str) -> None:
        """Refuse what clients may not do.

        Raises:
            UsageError: They may not; the text says why.
        """
        if objection := self.objection(verb, name):
            raise UsageError(objection)

    def shows(self, what: str, name: str) -> bool:
        """Return whether the patterns for topics, services or parameters include a name."""
        return matches(getattr(self, what), name)


def matches(patterns: tuple[Pattern, ...], name: str) -> bool:
    """Return whether a name matches any of the patterns; without patterns, every name does."""
    return not patterns or any(
        fnmatch.fnmatchcase(name, one) if isinstance(one, str) else one.fullmatch(name) is not None
        for one in patterns
    )
