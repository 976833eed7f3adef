"""A set of liveliness tokens, and the nodes and entities that it describes; pure."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from functools import cached_property
from typing import Self

from rosz.wire import Kind, ProcessToken, Token


class View:
    """Nodes and entities of one domain at one moment: all, or the followed ones.

    Args:
        tokens: The live tokens; several may describe one node.
        processes: The tokens of the processes of rosz nodes; ROS 2 announces none.
    """

    def __init__(self, tokens: Iterable[Token], processes: Iterable[ProcessToken] = ()) -> None:
        self.tokens: tuple[Token, ...] = tuple(tokens)
        self._processes = tuple(processes)

    @classmethod
    def of(cls, tokens: Iterable[Token | ProcessToken]) -> Self:
        """Return the view of live tokens of both kinds."""
        everything = list(tokens)
        return cls(
            (token for token in everything if isinstance(token, Token)),
            (token for token in everything if isinstance(token, ProcessToken)),
        )

    def nodes(self) -> list[str]:
        """Return the full names of all nodes, sorted; two nodes of one name appear twice."""
        # The token of an entity alone makes its node known: tokens may arrive in any order.
        numbered = {(t.zid, t.node_id, t.node_name) for t in self.tokens}
        return sorted(name for _, _, name in numbered)

    def processes(self, node: str | None = None) -> list[ProcessToken]:
        """Return the rosz nodes as processes, the oldest of each name first.

        Args:
            node: The full name of the nodes to return; all when not given.
        """
        return sorted(
            (p for p in self._processes if node is None or p.node == node),
            key=lambda p: (p.node, p.started, p.zid, p.node_id),
        )

    def entities(self, *kinds: Kind, name: str | None = None) -> list[Token]:
        """Return the entities of some kinds, sorted by name, node and number.

        Args:
            kinds: The kinds to return; all kinds when none is given.
            name: The topic or service to return entities of; all when not given.
        """
        candidates = self.tokens if name is None else self._by_name.get(name, ())
        return sorted(
            (t for t in candidates if t.qos is not None and (not kinds or t.kind in kinds)),
            key=lambda t: (t.name, t.node_name, t.zid, t.entity_id),
        )

    def publishers(self, topic: str) -> list[Token]:
        """Return the publishers of a topic."""
        return self.entities(Kind.PUBLISHER, name=topic)

    def subscriptions(self, topic: str) -> list[Token]:
        """Return the subscriptions of a topic."""
        return self.entities(Kind.SUBSCRIPTION, name=topic)

    def servers(self, service: str) -> list[Token]:
        """Return the servers of a service."""
        return self.entities(Kind.SERVICE, name=service)

    def clients(self, service: str) -> list[Token]:
        """Return the clients of a service."""
        return self.entities(Kind.CLIENT, name=service)

    def topics(self) -> dict[str, list[str]]:
        """Return every topic with the names of its types, both sorted."""
        return self._types(Kind.PUBLISHER, Kind.SUBSCRIPTION)

    def services(self) -> dict[str, list[str]]:
        """Return every service that has a server, with the names of its types, both sorted."""
        return self._types(Kind.SERVICE)

    @cached_property
    def _by_name(self) -> dict[str, list[Token]]:
        tokens: defaultdict[str, list[Token]] = defaultdict(list)
        for token in self.tokens:
            tokens[token.name].append(token)
        return dict(tokens)

    def _types(self, *kinds: Kind) -> dict[str, list[str]]:
        types: defaultdict[str, set[str]] = defaultdict(set)
        for token in self.tokens:
            if token.kind in kinds:
                types[token.name].add(token.type_name)
        return {name: sorted(types[name]) for name in sorted(types)}
