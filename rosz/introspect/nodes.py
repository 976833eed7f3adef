"""Nodes: listing and describing them as rosnode does, and asking rosz nodes about themselves.

A node that is not rosz's (a ROS 2 node) is listed, and does not answer requests.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable
from typing import TYPE_CHECKING, TypeVar

import msgspec

from rosz.errors import NotFoundError, RoszError, WaitTimeout, near_miss
from rosz.introspect.survey import Survey, take_survey
from rosz.names import is_of_action, ros1_type
from rosz.wire import Kind, Token, tokens_key

if TYPE_CHECKING:
    from rosz.node import NodeInfo
    from rosz.session import Session

PING_TIMEOUT = 3.0
"""Seconds that a node has to answer a ping."""
_KILL_TIMEOUT = 10.0
_RULE = "-" * 80

T = TypeVar("T")


class NodeEntry(msgspec.Struct, frozen=True, omit_defaults=True):
    """A node.

    Attributes:
        name: Full name.
        session: Id of its session.
        host: Host name; empty if unknown, as for ROS 2 nodes.
        pid: Process id; 0 if unknown.
        started: Start time in nanoseconds since the Unix epoch; 0 if unknown.
    """

    name: str
    session: str
    host: str = ""
    pid: int = 0
    started: int = 0

    @property
    def address(self) -> str:
        """Host and process id if known, or else the session."""
        return f"{self.host}, pid {self.pid}" if self.host else f"session {self.session}"


def list_nodes(survey: Survey) -> list[NodeEntry]:
    """Return an entry for each node, sorted by name."""
    nodes: dict[tuple[str, int], NodeEntry] = {}
    for token in survey.view.tokens:
        process = survey.process(token)
        details = () if process is None else (process.host, process.pid, process.started)
        nodes[token.zid, token.node_id] = NodeEntry(token.node_name, token.zid, *details)
    return sorted(nodes.values(), key=lambda node: (node.name, node.started, node.session))


def machines(nodes: Iterable[NodeEntry]) -> list[str]:
    """Return the hosts that nodes run on, sorted."""
    return sorted({node.host for node in nodes if node.host})


def find_nodes(survey: Survey, name: str) -> list[Token]:
    """Return one token for each node of a full name.

    Raises:
        NotFoundError: The node does not exist.
    """
    tokens = survey.nodes_named(name)
    if not tokens:
        raise NotFoundError(f"unknown node '{name}'{near_miss(name, survey.view.nodes())}")
    return tokens


def format_node(survey: Survey, node: Token) -> str:
    """Return the text of ``rosnode info`` about a node, from its tokens.

    Args:
        survey: The running nodes.
        node: One of the node's tokens.
    """
    lines = [_RULE, f"Node [{node.node_name}]"]
    for title, kind in (("Publications", Kind.PUBLISHER), ("Subscriptions", Kind.SUBSCRIPTION)):
        topics = {(t.name, ros1_type(t.name, t.type_name)) for t in _entities(survey, node, kind)}
        lines += _section(title, [f"{name} [{type_name}]" for name, type_name in sorted(topics)])
    served = {t.name for t in _entities(survey, node, Kind.SERVICE)}
    lines += _section("Services", sorted(served))
    return "\n".join(lines)


def _entities(survey: Survey, node: Token, *kinds: Kind) -> list[Token]:
    return [
        token
        for token in survey.view.entities(*kinds)
        if (token.zid, token.node_id) == (node.zid, node.node_id) and not is_of_action(token.name)
    ]


def _section(title: str, items: list[str]) -> list[str]:
    return (
        [f"{title}: ", *(f" * {item}" for item in items), ""] if items else [f"{title}: None", ""]
    )


def format_connections(survey: Survey, node: Token) -> str:
    """Return the text of ``rosnode info`` about the connections of a node.

    Args:
        survey: The running nodes.
        node: One of the node's tokens.
    """
    lines: list[str] = []
    for ours in _entities(survey, node, Kind.PUBLISHER, Kind.SUBSCRIPTION):
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


def nodes_on_machine(nodes: Iterable[NodeEntry], machine: str) -> list[str]:
    """Return the names of the nodes on a machine, sorted.

    Raises:
        NotFoundError: No node runs there.
    """
    entries = list(nodes)
    here = sorted(node.name for node in entries if node.host == machine)
    if not here:
        hosts = machines(entries)
        listing = f"; nodes run on {', '.join(hosts)}" if hosts else ""
        raise NotFoundError(f"no node runs on '{machine}'{near_miss(machine, hosts) or listing}")
    return here


def query_node(session: Session, node: Token, action: str, reply_type: type[T], **fields: str) -> T:
    """Send a request to a rosz node and return its reply.

    Args:
        session: The session to send it on.
        node: One of the node's tokens.
        action: Name of the request.
        reply_type: Type of the reply.
        fields: Further fields of the request.

    Raises:
        NotFoundError: Nothing replies: it is not a rosz node, or has just ended.
        WaitTimeout: The node does not reply in time.
        RoszError: The node refuses, or its reply cannot be decoded; the text says why.
    """
    from rosz.node import Request, control_key

    key = control_key(node.domain, node.zid, node.node_id)
    payload = msgspec.msgpack.encode(Request(action, **fields))
    replies = session.get(key, payload=payload, timeout=PING_TIMEOUT)
    if not replies:
        raise NotFoundError(
            f"node '{node.node_name}' does not take requests: it is not a rosz node"
        )
    reply = replies[0]
    if reply.ok:
        try:
            return msgspec.msgpack.decode(reply.payload, type=reply_type)
        except msgspec.MsgspecError as error:
            raise RoszError(
                f"node '{node.node_name}' sends a reply that cannot be decoded: {error}; is it of"
                " another version of rosz?"
            ) from error
    text = reply.payload.decode(errors="replace")
    if text == "Timeout":
        why = session.why_silent(node.zid) or "it hangs or is stopped"
        raise WaitTimeout(f"answer of node '{node.node_name}'", PING_TIMEOUT, why)
    raise RoszError(text)


def get_info(session: Session, node: Token) -> NodeInfo:
    """Return the information that a node gives of itself; errors as those of `query_node`."""
    from rosz.node import NodeInfo

    return query_node(session, node, "info", NodeInfo)


def ping(session: Session, node: Token) -> float:
    """Return how many seconds a node takes to reply.

    Args:
        session: The session to send the request on.
        node: One of the node's tokens.

    Raises:
        NotFoundError: The node has ended, or is not a rosz node.
        WaitTimeout: The node does not reply in time.
        RoszError: Its reply cannot be decoded.
    """
    began = time.perf_counter()
    try:
        get_info(session, node)
    except NotFoundError as error:
        if take_survey(session, node.domain).nodes_named(node.node_name):
            raise
        raise NotFoundError(f"node '{node.node_name}' has ended") from error
    return time.perf_counter() - began


def kill(session: Session, node: Token, reason: str) -> None:
    """Request a node to shut down, and wait until it is gone.

    Args:
        session: The session to send the request on.
        node: One of the node's tokens.
        reason: Reason that the node logs.

    Raises:
        NotFoundError: It is not a rosz node, and does not take requests.
        WaitTimeout: The node does not reply, or replies and stays.
        RoszError: The node refuses.
    """
    gone = threading.Event()
    prefix = f"{tokens_key(node.domain, node.zid).removesuffix('**')}{node.node_id}/"

    def changed(key: str, alive: bool) -> None:
        if not alive and key.startswith(prefix):
            gone.set()

    watch = session.watch_tokens(f"{prefix}{node.node_id}/NN/**", changed)
    try:
        query_node(session, node, "shutdown", bool, reason=reason)
        if not gone.wait(_KILL_TIMEOUT):
            raise WaitTimeout(
                f"end of node '{node.node_name}'",
                _KILL_TIMEOUT,
                "it accepted the request, and goes on",
            )
    finally:
        watch.close()


def kill_nodes(
    session: Session, survey: Survey, names: Iterable[str], reason: str
) -> list[tuple[str, RoszError]]:
    """Shut nodes down, and return the names of those that stay, each with the error.

    Args:
        session: The session to send the requests on.
        survey: The running nodes.
        names: Full names; each may be that of several nodes.
        reason: Reason that the nodes log.
    """
    failed: list[tuple[str, RoszError]] = []
    for name in names:
        for node in survey.nodes_named(name):
            try:
                kill(session, node, reason)
            except RoszError as error:
                failed.append((name, error))
    return failed


def get_levels(session: Session, node: Token) -> dict[str, str]:
    """Return the loggers of a node with their levels; errors as those of `query_node`."""
    return query_node(session, node, "levels", dict[str, str])


def set_level(session: Session, node: Token, logger: str, level: str) -> None:
    """Set the level of a logger of a node; errors as those of `query_node`."""
    query_node(session, node, "set_level", bool, logger=logger, level=level)


def follow_clock(session: Session, node: Token) -> None:
    """Let a node look at its ``use_sim_time`` again; errors as those of `query_node`."""
    query_node(session, node, "follow_clock", bool)
