"""Requests to a node about itself: information, shutdown, levels of loggers."""

from __future__ import annotations

import logging
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.errors import RoszError
from rosz.node.core import NodeCore
from rosz.wire import nodes_key, own_key, parse_token
from rosz.worker import Worker, start_thread

if TYPE_CHECKING:
    from rosz.node.context import Context
    from rosz.session import Query

__all__ = ("NodeInfo", "Request", "control_key", "serve_control")

_log = logging.getLogger("rosz.control")

_THREADS = 4
_TOKENS_TIMEOUT = 0.5


class NodeInfo(msgspec.Struct, frozen=True):
    """Information about a node.

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

    queryable = node.keep(context.session.pull_queryable(key, rare=True))
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
        _visible_sessions(node.context),
    )


def _visible_sessions(context: Context) -> list[str]:
    """Return the ids of the sessions whose nodes the session of a context sees."""
    keys = context.session.live_tokens(nodes_key(context.domain), _TOKENS_TIMEOUT)
    return sorted({parse_token(key).zid for key in keys})
