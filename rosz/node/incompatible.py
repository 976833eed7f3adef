"""Warnings about entities of one name that cannot reach each other, because their types differ."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING

from rosz.wire import NO_HASH, Kind, Token

if TYPE_CHECKING:
    from rosz.graph import Graph

__all__ = ("COUNTERPARTS", "IncompatibleEntities", "explain_incompatible")

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
    doing = f"'{other.node_name}' {_VERBS[other.kind]} {_NOUNS[other.kind]} '{own.name}'"
    if other.type_name != own.type_name:
        return (
            f"node {doing} with type '{other.type_name}', but here it has type"
            f" '{own.type_name}': they do not reach each other"
        )
    if other.type_hash == own.type_hash:
        return ""
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
    """Log a warning, once for each other node, about entities that cannot reach each other.

    Args:
        graph: The graph of the domain.
        zid: Id of the session of this process.
    """

    def __init__(self, graph: Graph, zid: str) -> None:
        self._graph = graph
        self._zid = zid
        self._lock = threading.RLock()  # a signal handler may declare or close an entity
        self._own: dict[str, dict[int, tuple[Token, logging.Logger]]] = {}
        self._warned: dict[int, set[str]] = {}
        graph.listen(self._changed)

    def watch(self, token: Token, log: logging.Logger) -> None:
        """Begin to watch an entity of this process; call it before the entity is announced.

        Args:
            token: Token of the entity.
            log: Logger for the warnings.
        """
        with self._lock:
            known = self._own.get(token.name, {})
            self._own[token.name] = {**known, token.entity_id: (token, log)}

    def unwatch(self, token: Token) -> None:
        """Stop watching an entity of this process; not an error if it is not watched."""
        with self._lock:
            known = self._own.get(token.name, {})
            rest = {number: entry for number, entry in known.items() if number != token.entity_id}
            if rest:
                self._own[token.name] = rest
            else:
                self._own.pop(token.name, None)
            self._warned.pop(token.entity_id, None)

    def _changed(self, token: Token, alive: bool) -> None:
        own = self._own.get(token.name)
        if not alive or not own:
            return
        newcomer = own.get(token.entity_id) if token.zid == self._zid else None
        if newcomer is not None:
            # An own entity appears like all others do, and is compared with those before it.
            for other in self._graph.view().entities(COUNTERPARTS[token.kind], name=token.name):
                self._compare(*newcomer, other)
        for entry in own.values():
            if entry is not newcomer and token.kind is COUNTERPARTS[entry[0].kind]:
                self._compare(*entry, token)

    def _compare(self, own: Token, log: logging.Logger, other: Token) -> None:
        warned = self._warned.get(own.entity_id, ())
        text = "" if other.node_name in warned else explain_incompatible(own, other)
        if text:
            self._warned.setdefault(own.entity_id, set()).add(other.node_name)
            log.warning("%s", text)
