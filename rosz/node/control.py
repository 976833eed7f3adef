"""What a node answers about itself, and how the older of two nodes of one name gives way."""

from __future__ import annotations

import os
import sys
import threading
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.errors import RoszError
from rosz.node.endpoint import Withdrawal
from rosz.wire import ProcessToken, own_key

if TYPE_CHECKING:
    from rosz.node.node import Node
    from rosz.session import Query

__all__ = ("NodeInfo", "attach", "control_key")

_REPLACED = "new node registered with same name"


class NodeInfo(msgspec.Struct, frozen=True):
    """What a node tells about itself.

    Attributes:
        name: Full name.
        pid: Process id.
        host: Host name.
        argv: Command line.
        started: Nanoseconds since the Unix epoch.
    """

    name: str
    pid: int
    host: str
    argv: list[str]
    started: int


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

    def arrived(query: Query) -> None:
        threading.Thread(
            target=_serve, args=(node, key, query), name=f"rosz-control{node.name}", daemon=True
        ).start()

    def appeared(other: ProcessToken, alive: bool) -> None:
        if not alive or other.node != node.name or other == node.process:
            return
        if other.newer_than(node.process):
            node.log.warning(
                "shutdown request: %s (process %d on %s)", _REPLACED, other.pid, other.host
            )
            threading.Thread(target=node.shutdown, args=(_REPLACED,), daemon=True).start()

    node.keep(context.session.queryable(key, arrived))
    node.keep(Withdrawal(context.graph.listen_to_processes(appeared)))


def _serve(node: Node, key: str, query: Query) -> None:
    shut_down = ""
    with query:
        try:
            request = msgspec.msgpack.decode(query.payload or b"\x80", type=Request)
            answer, shut_down = _answer(node, request)
            query.reply(key, msgspec.msgpack.encode(answer))
        except (msgspec.MsgspecError, RoszError, ValueError) as error:
            query.reply_error(str(error))
    if shut_down:
        node.shutdown(shut_down)


def _answer(node: Node, request: Request) -> tuple[Any, str]:
    """Return what to answer, and the reason of a shutdown to carry out after that."""
    match request.action:
        case "info":
            process = node.process
            info = NodeInfo(
                node.name, os.getpid(), process.host, [sys.executable, *sys.argv], process.started
            )
            return info, ""
        case "shutdown":
            return True, request.reason or "requested"
        case "levels":
            return node.log.get_levels(), ""
        case "set_level":
            node.log.set_level(request.logger, request.level)
            return True, ""
        case other:
            raise ValueError(f"'{other}' is nothing that a node can be asked")
