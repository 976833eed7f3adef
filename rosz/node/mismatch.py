"""Giving the classic silence a voice: endpoints of one name that cannot hear each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosz.node.endpoint import OPPOSITE
from rosz.wire import NO_HASH, Kind, Token

if TYPE_CHECKING:
    from rosz.graph import Graph
    from rosz.node.endpoint import Endpoint

__all__ = ("MismatchWatch", "mismatch")

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


def mismatch(own: Token, other: Token) -> str:
    """Say why two endpoints of one name do not reach each other.

    Args:
        own: That of this process.
        other: That of somebody else.

    Returns:
        A sentence; empty where they do reach each other.
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


class MismatchWatch:
    """Tells, once for each node on the other side, of endpoints that cannot reach each other.

    Args:
        graph: Where to look for them.
        zid: The session of this process.
    """

    def __init__(self, graph: Graph, zid: str) -> None:
        self._graph = graph
        self._zid = zid
        self._own: dict[str, dict[int, Endpoint]] = {}
        self._told: dict[int, set[str]] = {}
        graph.listen(self._changed)

    def add(self, endpoint: Endpoint) -> None:
        """Begin to watch over an endpoint of this process, before it is announced."""
        token = endpoint.token
        self._own[token.name] = {**self._own.get(token.name, {}), token.entity_id: endpoint}

    def remove(self, endpoint: Endpoint) -> None:
        """Stop watching over an endpoint."""
        token = endpoint.token
        rest = {n: e for n, e in self._own.get(token.name, {}).items() if e is not endpoint}
        if rest:
            self._own[token.name] = rest
        else:
            self._own.pop(token.name, None)
        self._told.pop(token.entity_id, None)

    def _changed(self, token: Token, alive: bool) -> None:
        own = self._own.get(token.name)
        if not alive or not own:
            return
        newcomer = own.get(token.entity_id) if token.zid == self._zid else None
        if newcomer is not None:
            # One of this process appears as all others do, and is held against those before it.
            for other in self._graph.view().entities(OPPOSITE[token.kind], name=token.name):
                self._compare(newcomer, other)
        for endpoint in own.values():
            if endpoint is not newcomer and token.kind is OPPOSITE[endpoint.token.kind]:
                self._compare(endpoint, token)

    def _compare(self, endpoint: Endpoint, other: Token) -> None:
        told = self._told.get(endpoint.token.entity_id, ())
        text = "" if other.node_name in told else mismatch(endpoint.token, other)
        if text:
            self._told.setdefault(endpoint.token.entity_id, set()).add(other.node_name)
            endpoint.node.log.warning("%s", text)
