"""The access policy of a server: who may connect, and what its clients may do."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeAlias

import msgspec

from rosz.access.connecting import is_password, password_in
from rosz.errors import UsageError
from rosz.security import EVERYTHING, Permit

NamePattern: TypeAlias = str | re.Pattern[str]
"""A pattern in an option of a bridge: a name with wildcards as in a shell, or a regular expression.

Both are ROS 1's: rosbridge_suite's ``topics_glob``, where ``*`` stands for slashes too, and
foxglove_bridge's ``topic_whitelist``. Rules have the patterns of `rosz.security` alone.
"""

Verb: TypeAlias = Literal["publish", "subscribe", "call", "serve", "set", "get"]

_CHANGES = frozenset({"publish", "call", "serve", "set"})
_OBJECTS = {"publish": "topics", "subscribe": "topics", "call": "services", "serve": "services"}


class AccessPolicy(msgspec.Struct, frozen=True):
    """The rights of the clients of a bridge. By default, programs on this machine have all.

    A client that sends the password may connect from any page; without it, from pages of this
    machine and of the listed origins.

    Attributes:
        permit: Permissions by the rules of the machine; None without rules.
        read_only: Whether clients change nothing.
        topics: Patterns of the topics that clients see; all if there is none.
        services: Patterns of the services.
        params: Patterns of the parameters.
        published: Patterns of the topics that clients publish; all that they see if there is none.
        password: Password of the clients; empty if they need none.
        origins: Origins of pages that may connect without it, such as ``http://robot:8000``; ``*``
            for all, ``null`` for pages that are files.
    """

    permit: Permit | None = None
    read_only: bool = False
    topics: tuple[NamePattern, ...] = ()
    services: tuple[NamePattern, ...] = ()
    params: tuple[NamePattern, ...] = ()
    published: tuple[NamePattern, ...] = ()
    password: str = ""
    origins: tuple[str, ...] = ()

    def shows_password(self, path: str, headers: Mapping[str, str]) -> bool | None:
        """Return whether the password in a request is right; None if there is none, or no need.

        Args:
            path: Path and query of the request.
            headers: Its headers.

        Raises:
            ValueError: The request is malformed.
        """
        given = password_in(path, headers) if self.password else ""
        return is_password(given, self.password) if given else None

    def is_authenticated(self, request: Any) -> bool:
        """Return whether a request shows the password, or needs none."""
        return not self.password or bool(self.shows_password(request.path, request.headers))

    def objection(self, verb: Verb, name: str) -> str:
        """Return why clients may not do something; empty if they may.

        Args:
            verb: The action.
            name: Full name of the topic, service or parameter.
        """
        if self.read_only and verb in _CHANGES:
            return self._read_only_objection(f"{verb} '{name}'")
        hidden = verb == "publish" and not matches_any(self.published, name)
        if hidden or not self.shows(_OBJECTS.get(verb, "params"), name):
            return f"clients may not {verb} '{name}': the patterns of this bridge leave it out"
        if self.permit is None:
            return ""
        allowed = self.permit.get if verb == "get" else self.permit.allows(verb, name)
        return "" if allowed else f"the rules of this machine do not let clients {verb} '{name}'"

    def _read_only_objection(self, action: str) -> str:
        return f"clients may not {action}: this bridge is read-only"

    def check(self, verb: Verb, name: str) -> None:
        """Refuse what clients may not do.

        Raises:
            UsageError: They may not; the text says why.
        """
        if objection := self.objection(verb, name):
            raise UsageError(objection)

    def shows(self, kind: str, name: str) -> bool:
        """Return whether the patterns for topics, services or parameters include a name."""
        return matches_any(getattr(self, kind), name)


class PagePolicy(AccessPolicy, frozen=True):
    """Permissions of those who use the page, which also has bags and launches of the machine."""

    def _read_only_objection(self, action: str) -> str:
        return f"this page is read-only: it may not {action}"

    @property
    def sees_launches(self) -> bool:
        """Whether the page may see launches and the output of their nodes."""
        return self.permit is None or self.permit.control

    def check_read_only(self, action: str) -> None:
        """Refuse to change anything where the page is read-only.

        Args:
            action: The action, such as ``play bags``.

        Raises:
            UsageError: It is.
        """
        if self.read_only:
            raise UsageError(self._read_only_objection(action))

    def check_control(self, action: str) -> None:
        """Refuse to control nodes, or to write and delete files, unless the page may.

        Args:
            action: The action, such as ``record bags``.

        Raises:
            UsageError: It may not; the text says why.
        """
        self.check_read_only(action)
        if self.permit is not None and not self.permit.control:
            raise UsageError(f"the rules of this machine do not let this page {action}")

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
        if not names and self.permit is not None and EVERYTHING not in getattr(self.permit, verb):
            raise UsageError(
                f"the rules of this machine do not let this page {verb} all topics; choose some"
            )


def matches_any(patterns: tuple[NamePattern, ...], name: str) -> bool:
    """Return whether any pattern of an option matches a name; without patterns, every name does."""
    return not patterns or any(
        fnmatch.fnmatchcase(name, pattern)
        if isinstance(pattern, str)
        else pattern.fullmatch(name) is not None
        for pattern in patterns
    )
