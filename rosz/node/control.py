"""Requests to a node about itself: information, shutdown, levels of loggers.

Of two nodes of one name in a domain, the newer one takes over, and the older one shuts down, as
ROS 1's master has it. The two compare their ages by such a request.
"""

from __future__ import annotations

import logging
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.errors import RoszError
from rosz.lifecycle import Registration
from rosz.node.core import NodeCore
from rosz.wire import ProcessToken, own_key
from rosz.worker import Worker, start_thread

if TYPE_CHECKING:
    from rosz.session import Query

__all__ = ("NodeInfo", "Request", "control_key", "serve_control", "yield_to_newer")

_log = logging.getLogger("rosz.control")

_THREADS = 4

_REASON = "new node registered with same name"
_REPLY_TIMEOUT = 1.0
_TOGETHER = 0.2
"""Seconds; of two nodes that start within this time, their own clocks tell which one is newer."""


class NodeInfo(msgspec.Struct, frozen=True):
    """What a node tells about itself.

    Attributes:
        name: Full name.
        pid: Process id.
        host: Host name.
        argv: Command line.
        started: Time of its start by its own clock, in nanoseconds since the Unix epoch.
        age: Seconds since its start, by the monotonic clock.
        now: Time of its system clock, in nanoseconds since the Unix epoch.
        sees: Ids of the sessions whose nodes it knows, its own among them.
    """

    name: str
    pid: int
    host: str
    argv: list[str]
    started: int
    age: float = 0.0
    now: int = 0
    sees: list[str] = []


class Request(msgspec.Struct, frozen=True):
    """A request to a node.

    Attributes:
        action: ``info``, ``shutdown``, ``levels`` or ``set_level``.
        reason: Reason of a ``shutdown``.
        logger: Name of the logger for ``set_level``.
        level: Name of the level for ``set_level``.
    """

    action: str
    reason: str = ""
    logger: str = ""
    level: str = ""


def control_key(domain: int, zid: str, node_id: int | str) -> str:
    """Return the key on which a node receives requests about itself."""
    return own_key(domain, "control", zid, str(node_id))


def serve_control(node: NodeCore) -> None:
    """Make a node respond to requests about itself."""
    context = node.context
    key = control_key(context.domain, context.session.zid, node.node_id)
    ending = threading.Lock()

    def serve(query: Query) -> None:
        reason = _serve(node, key, query)
        if reason and ending.acquire(blocking=False):
            # Hooks of the program may take their time, and more requests may come meanwhile.
            name = f"rosz-shutdown{node.name}"
            start_thread(
                threading.Thread(target=node.shutdown, args=(reason,), name=name, daemon=True)
            )

    queryable = node.keep(context.session.pull_queryable(key))
    Worker(f"rosz-control{node.name}", serve, receive=queryable.receive, threads=_THREADS)


def _serve(node: NodeCore, key: str, query: Query) -> str:
    """Respond to a request; return the reason of the shutdown that is to follow, if any."""
    with query:
        try:
            try:
                request = msgspec.msgpack.decode(query.payload or b"\x80", type=Request)
                response, shut_down = _respond(node, request)
            except (msgspec.MsgspecError, RoszError, ValueError) as error:
                query.reply_error(str(error))
                return ""
            query.reply(key, msgspec.msgpack.encode(response))
        except RoszError as error:
            _log.debug("cannot respond to a request to %s: %s", node.name, error)
            return ""
    return shut_down


def _respond(node: NodeCore, request: Request) -> tuple[Any, str]:
    """Return the response, and the reason of a shutdown to carry out after it."""
    match request.action:
        case "info":
            return _info(node), ""
        case "shutdown":
            return True, request.reason or "requested"
        case "levels":
            return node.log.get_levels(), ""
        case "set_level":
            node.log.set_level(request.logger, request.level)
            return True, ""
        case other:
            raise ValueError(f"a node has no action '{other}'")


def _info(node: NodeCore) -> NodeInfo:
    process, words = node.process, (sys.executable, *sys.argv)
    return NodeInfo(
        node.name,
        process.pid,
        process.host,
        # A command line need not be UTF-8, but only that can be sent.
        [word.encode(errors="surrogateescape").decode(errors="replace") for word in words],
        process.started,
        time.monotonic() - node.began,
        time.time_ns(),
        sorted({token.zid for token in node.context.graph.view().tokens}),
    )


def yield_to_newer(node: NodeCore) -> None:
    """Shut a node down when a newer one of the same name appears."""
    duplicates = Worker[ProcessToken](
        f"rosz-takeover{node.name}", lambda other: _compare(node, other), threads=_THREADS
    )

    def appeared(other: ProcessToken, alive: bool) -> None:
        if alive and other.node == node.name and other != node.process:
            duplicates.submit(other)

    node.keep(Registration(lambda: duplicates.close(0)))
    node.keep(Registration(node.context.graph.listen_to_processes(appeared)))


def _compare(node: NodeCore, other: ProcessToken) -> None:
    """Shut a node down if another one of its name is newer."""
    if not node.is_shutdown and _is_newer(node, other):
        node.log.warning("shutdown request: %s (process %d on %s)", _REASON, other.pid, other.host)
        node.shutdown(_REASON)


def _is_newer(node: NodeCore, other: ProcessToken) -> bool:
    """Return whether another node is newer, whatever the clocks of the two machines show."""
    key = control_key(other.domain, other.zid, other.node_id)
    request = msgspec.msgpack.encode(Request("info"))
    asked = time.monotonic()
    try:
        replies = node.context.session.get(key, payload=request, timeout=_REPLY_TIMEOUT)
        infos = [msgspec.msgpack.decode(r.payload, type=NodeInfo) for r in replies if r.ok]
    except (RoszError, msgspec.DecodeError):
        infos = []
    if infos:
        journey = time.monotonic() - asked
        lead = asked + journey / 2 - node.began - infos[0].age
        if abs(lead) > max(_TOGETHER, journey):
            return lead > 0
    # Two that start together, or one that does not respond: the times they gave themselves decide.
    return other.newer_than(node.process)
