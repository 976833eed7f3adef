"""rosgraph.impl.graph: nodes and topics with the connections between them.

Everything comes from one look at the graph; there are no nodes to contact.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from rosz.ros1.tools.rosgraph.masterapi import Master

_NAME = "/rosviz"


def topic_node(topic: str) -> str:
    """Return the name of a topic among nodes, which no node has."""
    return f" {topic}"


def node_topic(node: str) -> str:
    """Return the topic of a name that `topic_node` returned."""
    return node[1:]


class BadNode:
    """A node that does not answer; there are none here."""

    DEAD = 0
    WONKY = 1

    def __init__(self, name: str, type: int, reason: str) -> None:  # noqa: A002  # ROS 1's
        self.name = name
        self.type = type
        self.reason = reason


class Edge:
    """A connection.

    Args:
        start: Node or topic that it begins at.
        end: Node or topic that it ends at.
        label: Its text.

    Attributes:
        key: Start and label.
        rkey: End and label.
    """

    __slots__ = ("end", "key", "label", "rkey", "start")

    def __init__(self, start: str, end: str, label: str = "") -> None:
        self.start = start
        self.end = end
        self.label = label
        self.key = f"{start}|{label}"
        self.rkey = f"{end}|{label}"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Edge) and (self.start, self.end) == (other.start, other.end)

    def __hash__(self) -> int:
        return hash((self.start, self.end))

    def __str__(self) -> str:
        return f"{self.start}->{self.end}"


def edge_args(start: str, dest: str, direction: str, label: str) -> list[tuple[str, str, str]]:
    """Return the arguments of edges between two nodes.

    Args:
        start: One node.
        dest: The other node.
        direction: ``o`` for out of the first one, ``i`` for into it, ``b`` for both.
        label: Text of the edges.
    """
    out = [(start, dest, label)] if direction in {"o", "b"} else []
    into = [(dest, start, label)] if direction in {"i", "b"} else []
    return out + into


class EdgeList:
    """Connections.

    Attributes:
        edges_by_start: Edges by their keys.
        edges_by_end: Edges by their rkeys.
    """

    __slots__ = ("edges_by_end", "edges_by_start")

    def __init__(self) -> None:
        self.edges_by_start: dict[str, list[Edge]] = {}
        self.edges_by_end: dict[str, list[Edge]] = {}

    def __iter__(self) -> Iterator[Edge]:
        return itertools.chain.from_iterable(list(self.edges_by_start.values()))

    def __contains__(self, edge: Edge) -> bool:
        return edge in self.edges_by_start.get(edge.key, ())

    def has(self, edge: Edge) -> bool:
        """Return whether an edge is there."""
        return edge in self

    def add(self, edge: Edge) -> bool:
        """Add an edge; return whether it is new."""
        if edge in self:
            return False
        self.edges_by_start.setdefault(edge.key, []).append(edge)
        self.edges_by_end.setdefault(edge.rkey, []).append(edge)
        return True

    def add_edges(self, start: str, dest: str, direction: str, label: str = "") -> bool:
        """Add the edges that `edge_args` describes; return whether one is new."""
        if not start or not dest:
            return False
        added = [self.add(Edge(*ends)) for ends in edge_args(start, dest, direction, label)]
        return any(added)

    def delete(self, edge: Edge) -> None:
        """Remove an edge, if it is there."""
        for edges, key in ((self.edges_by_start, edge.key), (self.edges_by_end, edge.rkey)):
            if edge in edges.get(key, ()):
                edges[key].remove(edge)

    def delete_all(self, node: str) -> None:
        """Remove the edges that begin or end at a node."""
        for edge in [member for member in self if node in {member.start, member.end}]:
            self.delete(edge)


class Graph:
    """The graph, as of the last `update`.

    Args:
        node_ns: Namespace of the nodes.
        topic_ns: Namespace of the topics.

    Attributes:
        nn_nodes: Names of the nodes.
        nt_nodes: Names of the topics, as `topic_node` returns them.
        srvs: Names of the services.
        nn_edges: Connections between nodes, with the topics as labels.
        nt_edges: Connections between nodes and topics that have both ends.
        nt_all_edges: All connections between nodes and topics.
        bad_nodes: Nodes that do not answer, by their names; empty.
    """

    def __init__(self, node_ns: str = "/", topic_ns: str = "/") -> None:
        self.master = Master(_NAME)
        self.node_ns = node_ns or "/"
        self.topic_ns = topic_ns or "/"
        self.nn_nodes: set[str] = set()
        self.nt_nodes: set[str] = set()
        self.srvs: set[str] = set()
        self.bad_nodes: dict[str, BadNode] = {}
        self.nn_edges = EdgeList()
        self.nt_edges = EdgeList()
        self.nt_all_edges = EdgeList()

    def set_master_stale(self, stale_secs: float) -> None:
        """Do nothing: every `update` looks at the graph."""

    def set_node_stale(self, stale_secs: float) -> None:
        """Do nothing: no node is asked."""

    def bad_update(self) -> bool:
        """Return whether a node answers again; there are none that do not."""
        return False

    def update(self) -> bool:
        """Look at the graph, and return whether anything has changed."""
        before = self._content()
        publishers, subscribers, services = self.master.getSystemState()
        self.srvs = {name for name, _ in services}
        self.nn_nodes, self.nt_nodes = set(), set()
        self.nn_edges, self.nt_edges, self.nt_all_edges = EdgeList(), EdgeList(), EdgeList()
        readers = self._of(subscribers)
        writers = self._of(publishers)
        for topic in {**writers, **readers}:
            self._add_topic(topic, writers.get(topic, []), readers.get(topic, []))
        return self._content() != before

    def _of(self, state: list[list[object]]) -> dict[str, list[str]]:
        return {
            str(topic): [node for node in nodes if node.startswith(self.node_ns)]
            for topic, nodes in state
            if str(topic).startswith(self.topic_ns) and isinstance(nodes, list)
        }

    def _add_topic(self, topic: str, writers: list[str], readers: list[str]) -> None:
        name = topic_node(topic)
        self.nt_nodes.add(name)
        self.nn_nodes |= {*writers, *readers}
        lists = [self.nt_all_edges] + [self.nt_edges] * bool(writers and readers)
        for edges in lists:
            for node in writers:
                edges.add_edges(node, name, "o")
            for node in readers:
                edges.add_edges(node, name, "i")
        for writer, reader in itertools.product(writers, readers):
            self.nn_edges.add_edges(writer, reader, "o", topic)

    def _content(self) -> tuple[set[str], set[str], set[tuple[str, str]]]:
        return self.nn_nodes, self.srvs, {(edge.start, edge.end) for edge in self.nt_all_edges}
