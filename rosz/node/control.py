"""Requests of other processes to a node, and the shutdown when a newer node takes its name.

The requests ask for information, shut the node down, or set the levels of its loggers. If two nodes
in a domain have one name, the older one shuts down, as with ROS 1's master.
"""

from __future__ import annotations

import logging
import sys
import threading
import time
from contextlib import suppress
from typing import Any

import msgspec

from rosz.errors import RoszError, WaitTimeout
from rosz.graph import Followed
from rosz.lifecycle import Registration
from rosz.node.core import NodeCore
from rosz.node.standard import follow_clock
from rosz.session import Query
from rosz.wire import ProcessToken, nodes_key, own_key, parse_token
from rosz.worker import Worker, start_thread

_log = logging.getLogger("rosz.control")

_THREADS = 4
_TOKENS_TIMEOUT = 0.5
_ATTEMPTS = 10
_PAUSE = 0.1
_NEWER = "new node registered with same name"
_REPLY_TIMEOUT = 1.0
_TOGETHER = 0.2
"""Seconds between two starts below which the times in the tokens tell which node is newer."""


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
        action: ``info``, ``shutdown``, ``levels``, ``set_level``, or ``follow_clock`` after
            a change of the node's ``use_sim_time``.
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

    worker = node.keep(Worker[Query](f"rosz-control{node.name}", serve, threads=_THREADS))
    node.keep(context.session.queryable(key, worker.submit))


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
        case "follow_clock":
            if node.parameter_owner is None:
                follow_clock(node)
            return True, ""
        case other:
            raise ValueError(f"a node has no action '{other}'")


def _info(node: NodeCore) -> NodeInfo:
    process, words, context = node.process, (sys.executable, *sys.argv), node.context
    return NodeInfo(
        node.name,
        process.pid,
        process.host,
        # A command line need not be UTF-8, but only that can be sent.
        [word.encode(errors="surrogateescape").decode(errors="replace") for word in words],
        process.started,
        time.monotonic() - node.began,
        time.time_ns(),
        # The sessions whose nodes its own session sees.
        sorted(
            {
                parse_token(key).zid
                for key in context.session.live_tokens(nodes_key(context.domain), _TOKENS_TIMEOUT)
            }
        ),
    )


def yield_to_newer(node: NodeCore) -> None:
    """Shut a node down when a newer one of the same name appears."""
    namesakes = node.keep(node.context.graph.follow_processes(node.name))

    def compare(other: ProcessToken) -> None:
        if not node.is_shutdown and _is_newer(node, namesakes, other):
            text = "shutdown request: [%s] Reason: %s (process %d on %s)"
            node.log.warning(text, node.name, _NEWER, other.pid, other.host)
            node.shutdown(_NEWER)

    duplicates = Worker[ProcessToken](f"rosz-takeover{node.name}", compare, threads=_THREADS)

    def appeared(other: ProcessToken, alive: bool) -> None:
        if alive and other.node == node.name and other != node.process:
            duplicates.submit(other)

    node.keep(Registration(lambda: duplicates.close(0)))
    node.keep(Registration(namesakes.listen(appeared)))


def _is_newer(node: NodeCore, namesakes: Followed, other: ProcessToken) -> bool:
    """Return whether another node is newer, even if the clocks of the two machines differ."""
    key = control_key(other.domain, other.zid, other.node_id)
    request = msgspec.msgpack.encode(Request("info"))
    for _ in range(_ATTEMPTS):
        asked = time.monotonic()
        try:
            replies = node.context.session.get(key, payload=request, timeout=_REPLY_TIMEOUT)
            infos = [msgspec.msgpack.decode(r.payload, type=NodeInfo) for r in replies if r.ok]
        except (RoszError, msgspec.DecodeError):
            break
        if infos:
            round_trip = time.monotonic() - asked
            lead = asked + round_trip / 2 - node.began - infos[0].age
            if abs(lead) > max(_TOGETHER, round_trip):
                return lead > 0
        if replies:
            break
        # A node responds only some time after its token arrives, and not after its end.
        with suppress(WaitTimeout):
            namesakes.wait_for(lambda view: other not in view.processes(), _PAUSE, "its end")
            return False
    # They started together, or the other one did not respond: compare the times in their tokens.
    return other.newer_than(node.process)
