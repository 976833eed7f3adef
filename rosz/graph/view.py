"""A set of liveliness tokens, and the questions that people ask of it; pure."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from functools import cached_property

from rosz.wire import Kind, ProcessToken, Token

__all__ = ("View",)


class View:
    """The nodes and endpoints of one domain at one moment.

    Args:
        tokens: The tokens that are alive; several may describe one node.
        processes: The rosz nodes among them, as processes; ROS 2 tells none.
    """

    def __init__(self, tokens: Iterable[Token], processes: Iterable[ProcessToken] = ()) -> None:
        self.tokens = tuple(tokens)
        self._processes = tuple(processes)

    def nodes(self) -> list[str]:
        """Return the full names of all nodes, sorted; two nodes of one name appear twice."""
        # An endpoint's token alone makes its node known: tokens may arrive in any order.
        found = {(t.zid, t.node_id, t.node_name) for t in self.tokens}
        return sorted(name for _, _, name in found)

    def processes(self, node: str | None = None) -> list[ProcessToken]:
        """Return the rosz nodes as processes, the oldest of each name first.

        Args:
            node: Only those of this full name.
        """
        return sorted(
            (p for p in self._processes if node is None or p.node == node),
            key=lambda p: (p.node, p.started, p.zid, p.node_id),
        )

    def is_rosz(self, zid: str) -> bool:
        """Tell whether a session belongs to rosz nodes."""
        return zid in self._own_sessions

    def endpoints(self, *kinds: Kind, name: str | None = None) -> list[Token]:
        """Return endpoints of some kinds, sorted by name, node and number.

        Args:
            kinds: What to return; every kind of endpoint when none is given.
            name: Only those of this topic or service.
        """
        candidates = self.tokens if name is None else self._by_name.get(name, ())
        return sorted(
            (t for t in candidates if t.qos is not None and (not kinds or t.kind in kinds)),
            key=lambda t: (t.name, t.node_name, t.zid, t.entity_id),
        )

    def publishers(self, topic: str) -> list[Token]:
        """Return the publishers of a topic."""
        return self.endpoints(Kind.PUBLISHER, name=topic)

    def subscriptions(self, topic: str) -> list[Token]:
        """Return the subscriptions of a topic."""
        return self.endpoints(Kind.SUBSCRIPTION, name=topic)

    def servers(self, service: str) -> list[Token]:
        """Return who serves a service."""
        return self.endpoints(Kind.SERVICE, name=service)

    def clients(self, service: str) -> list[Token]:
        """Return the clients of a service."""
        return self.endpoints(Kind.CLIENT, name=service)

    def topics(self) -> dict[str, list[str]]:
        """Return every topic with the names of its types, both sorted."""
        return self._types(Kind.PUBLISHER, Kind.SUBSCRIPTION)

    def services(self) -> dict[str, list[str]]:
        """Return every service that is served, with the names of its types, both sorted."""
        return self._types(Kind.SERVICE)

    @cached_property
    def _by_name(self) -> dict[str, list[Token]]:
        found: defaultdict[str, list[Token]] = defaultdict(list)
        for token in self.tokens:
            found[token.name].append(token)
        return dict(found)

    @cached_property
    def _own_sessions(self) -> frozenset[str]:
        return frozenset(process.zid for process in self._processes)

    def _types(self, *kinds: Kind) -> dict[str, list[str]]:
        found: defaultdict[str, set[str]] = defaultdict(set)
        for token in self.tokens:
            if token.kind in kinds:
                found[token.name].add(token.type_name)
        return {name: sorted(found[name]) for name in sorted(found)}
