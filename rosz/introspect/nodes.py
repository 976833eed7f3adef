"""Nodes as rosnode lists and describes them."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from rosz.errors import NotFoundError, near_miss
from rosz.introspect.survey import Survey, ros1_type
from rosz.wire import Kind, Token

__all__ = (
    "NodeEntry",
    "connections",
    "describe",
    "list_nodes",
    "machines",
    "members",
    "on_machine",
)

_RULE = "-" * 80


class NodeEntry(msgspec.Struct, frozen=True, omit_defaults=True):
    """A node.

    Attributes:
        name: Full name.
        session: Id of its session.
        host: Host name; empty where it does not tell, as ROS 2 nodes.
        pid: Process id; 0 where it does not tell.
        started: Nanoseconds since the Unix epoch; 0 where it does not tell.
    """

    name: str
    session: str
    host: str = ""
    pid: int = 0
    started: int = 0

    @property
    def address(self) -> str:
        """Where it is, as far as it tells."""
        return f"{self.host}, pid {self.pid}" if self.host else f"session {self.session}"


def list_nodes(survey: Survey) -> list[NodeEntry]:
    """Return all nodes, sorted by name; several of one name are several entries."""
    found: dict[tuple[str, int], NodeEntry] = {}
    for token in survey.view.tokens:
        process = survey.process(token)
        found[token.zid, token.node_id] = (
            NodeEntry(token.node_name, token.zid)
            if process is None
            else NodeEntry(token.node_name, token.zid, process.host, process.pid, process.started)
        )
    return sorted(found.values(), key=lambda node: (node.name, node.started, node.session))


def machines(nodes: Iterable[NodeEntry]) -> list[str]:
    """Return the hosts that nodes run on, sorted."""
    return sorted({node.host for node in nodes if node.host})


def members(survey: Survey, name: str) -> list[Token]:
    """Return one token for every node of a full name.

    Raises:
        NotFoundError: There is none.
    """
    found = survey.members(name)
    if not found:
        raise NotFoundError(f"unknown node '{name}'{near_miss(name, survey.view.nodes())}")
    return found


def describe(survey: Survey, node: Token) -> str:
    """Return what ``rosnode info`` prints about a node before it asks it.

    Args:
        survey: Who is there.
        node: One of the node's tokens.
    """
    lines = [_RULE, f"Node [{node.node_name}]"]
    for title, kind in (("Publications", Kind.PUBLISHER), ("Subscriptions", Kind.SUBSCRIPTION)):
        found = {(t.name, ros1_type(t.type_name)) for t in _endpoints(survey, node, kind)}
        lines += _section(title, [f"{name} [{type_name}]" for name, type_name in sorted(found)])
    served = {t.name for t in _endpoints(survey, node, Kind.SERVICE)}
    lines += _section("Services", sorted(served))
    return "\n".join(lines)


def _endpoints(survey: Survey, node: Token, *kinds: Kind) -> list[Token]:
    return [
        token
        for token in survey.view.endpoints(*kinds)
        if (token.zid, token.node_id) == (node.zid, node.node_id)
    ]


def _section(title: str, items: list[str]) -> list[str]:
    return (
        [f"{title}: ", *(f" * {item}" for item in items), ""] if items else [f"{title}: None", ""]
    )


def connections(survey: Survey, node: Token) -> str:
    """Return what ``rosnode info`` prints about whom a node exchanges messages with.

    Args:
        survey: Who is there.
        node: One of the node's tokens.
    """
    lines: list[str] = []
    for ours in _endpoints(survey, node, Kind.PUBLISHER, Kind.SUBSCRIPTION):
        outbound = ours.kind is Kind.PUBLISHER
        others = survey.view.subscriptions if outbound else survey.view.publishers
        for other in others(ours.name):
            if (other.type_name, other.type_hash) != (ours.type_name, ours.type_hash):
                continue
            lines += [
                f" * topic: {ours.name}",
                f"    * to: {other.node_name} ({survey.address(other)})",
                f"    * direction: {'outbound' if outbound else 'inbound'}",
                "    * transport: Zenoh",
            ]
    return "\n".join(["Connections:", *lines, ""]) if lines else ""


def on_machine(nodes: Iterable[NodeEntry], machine: str) -> list[str]:
    """Return the names of the nodes on a machine, sorted.

    Raises:
        NotFoundError: None runs there.
    """
    known = list(nodes)
    found = sorted(node.name for node in known if node.host == machine)
    if not found:
        hosts = machines(known)
        listing = f"; nodes run on {', '.join(hosts)}" if hosts else ""
        raise NotFoundError(f"no node runs on '{machine}'{near_miss(machine, hosts) or listing}")
    return found
