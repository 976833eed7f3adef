"""Warnings about entities of one name that cannot reach each other, because their types differ."""

from __future__ import annotations

import logging

from rosz.wire import NO_HASH, Kind, Token

COUNTERPARTS = {
    Kind.PUBLISHER: Kind.SUBSCRIPTION,
    Kind.SUBSCRIPTION: Kind.PUBLISHER,
    Kind.SERVICE: Kind.CLIENT,
    Kind.CLIENT: Kind.SERVICE,
}
"""The kind that each kind of entity exchanges data with."""

_NOUNS = {
    Kind.PUBLISHER: "topic",
    Kind.SUBSCRIPTION: "topic",
    Kind.SERVICE: "service",
    Kind.CLIENT: "service",
}
_VERBS = {
    Kind.PUBLISHER: "publishes",
    Kind.SUBSCRIPTION: "subscribes to",
    Kind.SERVICE: "serves",
    Kind.CLIENT: "calls",
}
_HASH_SHOWN = 15


def explain_incompatible(own: Token, other: Token) -> str:
    """Return why two entities of one name do not reach each other.

    Args:
        own: The entity of this process.
        other: The entity of another node.

    Returns:
        A sentence; empty if they do reach each other.
    """
    if (other.name, other.type_name, other.type_hash) == (own.name, own.type_name, own.type_hash):
        return ""
    doing = f"'{other.node_name}' {_VERBS[other.kind]} {_NOUNS[other.kind]} '{own.name}'"
    if other.type_name != own.type_name:
        return (
            f"node {doing} with type '{other.type_name}', but here it has type"
            f" '{own.type_name}': they do not reach each other"
        )
    if other.type_hash == NO_HASH:
        return (
            f"node {doing} without a type hash, as ROS 2 Humble does: they do not reach each"
            " other; set ROS_DISTRO=humble here, or update that side to ROS 2 Jazzy or later"
        )
    if own.type_hash == NO_HASH:
        return (
            f"node {doing} with a type hash, as ROS 2 Jazzy and later do, but ROS_DISTRO=humble is"
            " set here: they do not reach each other"
        )
    return (
        f"node {doing} with another definition of '{own.type_name}'"
        f" ({other.type_hash[:_HASH_SHOWN]}…, here {own.type_hash[:_HASH_SHOWN]}…):"
        " they do not reach each other; bring both sides to one version of the definition"
    )


class IncompatibleEntities:
    """Log a warning, once for each other node, about entities that one cannot reach.

    Args:
        own: Token of the entity of this process.
        log: Logger for the warnings.
    """

    def __init__(self, own: Token, log: logging.Logger) -> None:
        self._own = own
        self._log = log
        self._warned: set[str] = set()

    def changed(self, other: Token, alive: bool) -> None:
        """Compare with an entity that exchanges data with this kind, when it appears."""
        if not alive or other.node_name in self._warned:
            return
        text = explain_incompatible(self._own, other)
        if text:
            self._warned.add(other.node_name)
            self._log.warning("%s", text)
