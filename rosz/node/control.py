"""What a node answers about itself, and how the older of two nodes of one name gives way."""

from __future__ import annotations

import logging
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.errors import RoszError
from rosz.node.endpoint import Withdrawal
from rosz.node.pool import Jobs, Pool
from rosz.session.starting import start
from rosz.wire import ProcessToken, own_key

if TYPE_CHECKING:
    from rosz.node.node import Node
    from rosz.session import Query

__all__ = ("NodeInfo", "attach", "control_key")

_log = logging.getLogger("rosz.control")

_REPLACED = "new node registered with same name"
_ANSWER_BY = 1.0
_TOGETHER = 0.2
_THREADS = 4


class NodeInfo(msgspec.Struct, frozen=True):
    """What a node tells about itself.

    Attributes:
        name: Full name.
        pid: Process id.
        host: Host name.
        argv: Command line.
        started: Nanoseconds since the Unix epoch.
        age: Seconds since then, by no clock that anybody sets.
        now: What its system clock says at this moment, in nanoseconds since the Unix epoch.
        sees: The sessions of which it knows nodes, its own among them.
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
    """What is asked of a node.

    Attributes:
        action: ``info``, ``shutdown``, ``levels`` or ``set_level``.
        reason: For ``shutdown``.
        logger: For ``set_level``.
        level: For ``set_level``.
    """

    action: str
    reason: str = ""
    logger: str = ""
    level: str = ""


def control_key(domain: int, zid: str, node_id: int | str) -> str:
    """Return the key on which a node is asked about itself."""
    return own_key(domain, "control", zid, str(node_id))


def attach(node: Node) -> None:
    """Have a node answer for itself, and give way to a newer one of its name."""
    context = node.context
    key = control_key(context.domain, context.session.zid, node.node_id)
    began = time.monotonic()
    ending = threading.Lock()
    rivals: Jobs[ProcessToken] = Jobs()
    contests: list[Pool[ProcessToken]] = []

    def serve(query: Query) -> None:
        reason = _serve(node, key, query, began)
        if reason and ending.acquire(blocking=False):
            # Hooks of the program may take their time, and more may be asked meanwhile.
            name = f"rosz-shutdown{node.name}"
            start(threading.Thread(target=node.shutdown, args=(reason,), name=name, daemon=True))

    def contend(other: ProcessToken) -> None:
        _contend(node, other, began)

    def appeared(other: ProcessToken, alive: bool) -> None:
        if alive and other.node == node.name and other != node.process:
            rivals.put(other)
            if not contests:
                contests.append(Pool(_THREADS, f"rosz-rivals{node.name}", rivals.take, contend))

    questions = context.session.pull_queryable(key)
    node.keep(questions)
    Pool(_THREADS, f"rosz-control{node.name}", questions.receive, serve)
    node.keep(rivals)
    node.keep(Withdrawal(context.graph.listen_to_processes(appeared)))


def _contend(node: Node, other: ProcessToken, began: float) -> None:
    """End a node if another one of its name is newer."""
    if not node.is_shutdown and _is_newer(node, other, began):
        node.log.warning(
            "shutdown request: %s (process %d on %s)", _REPLACED, other.pid, other.host
        )
        node.shutdown(_REPLACED)


def _is_newer(node: Node, other: ProcessToken, began: float) -> bool:
    """Tell whether another node came later, whatever the clocks of the two machines say."""
    key = control_key(other.domain, other.zid, other.node_id)
    ask = msgspec.msgpack.encode(Request("info"))
    asked = time.monotonic()
    try:
        replies = node.context.session.get(key, payload=ask, timeout=_ANSWER_BY)
        infos = [msgspec.msgpack.decode(r.payload, type=NodeInfo) for r in replies if r.ok]
    except (RoszError, msgspec.DecodeError):
        infos = []
    if infos:
        journey = time.monotonic() - asked
        lead = asked + journey / 2 - began - infos[0].age
        if abs(lead) > max(_TOGETHER, journey):
            return lead > 0
    # Two that start together, or one that does not answer, go by the times they gave themselves.
    return other.newer_than(node.process)


def _serve(node: Node, key: str, query: Query, began: float) -> str:
    """Answer a question; return the reason of the shutdown that is to follow, if one is."""
    with query:
        try:
            try:
                request = msgspec.msgpack.decode(query.payload or b"\x80", type=Request)
                answer, shut_down = _answer(node, request, time.monotonic() - began)
            except (msgspec.MsgspecError, RoszError, ValueError) as error:
                query.reply_error(str(error))
                return ""
            query.reply(key, msgspec.msgpack.encode(answer))
        except RoszError as error:
            _log.debug("who asks %s cannot be answered: %s", node.name, error)
            return ""
    return shut_down


def _info(node: Node, age: float) -> NodeInfo:
    process = node.process
    return NodeInfo(
        node.name,
        process.pid,
        process.host,
        [_sound(word) for word in (sys.executable, *sys.argv)],
        process.started,
        age,
        time.time_ns(),
        sorted({token.zid for token in node.context.graph.view().tokens}),
    )


def _sound(word: str) -> str:
    """Return a word of a command line, which may be no UTF-8, as a text that can be sent."""
    return word.encode(errors="surrogateescape").decode(errors="replace")


def _answer(node: Node, request: Request, age: float) -> tuple[Any, str]:
    """Return what to answer, and the reason of a shutdown to carry out after that."""
    match request.action:
        case "info":
            return _info(node, age), ""
        case "shutdown":
            return True, request.reason or "requested"
        case "levels":
            return node.log.get_levels(), ""
        case "set_level":
            node.log.set_level(request.logger, request.level)
            return True, ""
        case other:
            raise ValueError(f"'{other}' is nothing that a node can be asked")
