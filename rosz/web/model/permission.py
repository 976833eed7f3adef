"""Permissions of those who use the page."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from rosz.bridges.gate import Gate, Verb
from rosz.errors import UsageError
from rosz.security import Permit

__all__ = ("Permission",)

_ALL = "/**"
"""The pattern for all names."""
_CHANGES = frozenset({"publish", "call", "serve", "set"})


class Permission(msgspec.Struct, frozen=True):
    """Permissions of those who use the page.

    Attributes:
        permit: Permissions by the rules of the machine; None without rules.
        read_only: Whether the page changes nothing.
    """

    permit: Permit | None = None
    read_only: bool = False

    def objection(self, verb: Verb, name: str) -> str:
        """Return why the page may not do something; empty if it may.

        Args:
            verb: The action.
            name: Full name of the topic, service or parameter.
        """
        if self.read_only and verb in _CHANGES:
            return f"this page is read-only: it may not {verb} '{name}'"
        return Gate(self.permit).objection(verb, name)

    def check(self, verb: Verb, name: str) -> None:
        """Refuse what the page may not do.

        Raises:
            UsageError: It may not; the text says why.
        """
        if objection := self.objection(verb, name):
            raise UsageError(objection)

    @property
    def sees_launches(self) -> bool:
        """Whether the page may see launches and the output of their nodes."""
        return self.permit is None or self.permit.control

    def check_read_only(self, what: str) -> None:
        """Refuse to change anything where the page is read-only.

        Args:
            what: What it is about to do, such as ``play bags``.

        Raises:
            UsageError: It is.
        """
        if self.read_only:
            raise UsageError(f"this page is read-only: it may not {what}")

    def check_files(self, what: str) -> None:
        """Refuse to write and delete files of this machine, unless the page may.

        Args:
            what: What it is about to do, such as ``record bags``.

        Raises:
            UsageError: It may not; the text says why.
        """
        self.check_read_only(what)
        if self.permit is not None and not self.permit.control:
            raise UsageError(f"the rules of this machine do not let this page {what}")

    def check_topics(self, verb: Verb, names: Sequence[str]) -> None:
        """Refuse what the page may not do with topics.

        Args:
            verb: The action.
            names: Full names of the topics; all if there is none.

        Raises:
            UsageError: It may not; the text says why.
        """
        for name in names:
            self.check(verb, name)
        if not names and self.permit is not None and _ALL not in getattr(self.permit, verb):
            raise UsageError(
                f"the rules of this machine do not let this page {verb} all topics; choose some"
            )

    def check_control(self, node: str) -> None:
        """Refuse to control a node, unless the page may.

        Raises:
            UsageError: It may not; the text says why.
        """
        if self.read_only:
            raise UsageError(f"this page is read-only: it may not control '{node}'")
        if self.permit is not None and not self.permit.control:
            raise UsageError(f"the rules of this machine do not let this page control '{node}'")
