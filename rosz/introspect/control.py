"""Asking rosz nodes about themselves, and telling them to end."""

from __future__ import annotations

import threading
from typing import TypeVar

import msgspec

from rosz.errors import NotFoundError, RoszError, WaitTimeout
from rosz.node.control import NodeInfo, Request, control_key
from rosz.session import Session
from rosz.wire import Token, tokens_key

__all__ = ("ask", "ask_info", "end", "get_levels", "set_level")

T = TypeVar("T")
_TIMEOUT = 3.0
_END_SECONDS = 10.0


def ask(
    session: Session, node: Token, request: Request, answer: type[T], timeout: float = _TIMEOUT
) -> T:
    """Ask a node.

    Args:
        session: Where to ask.
        node: One of the node's tokens.
        request: What.
        answer: Type of the answer.
        timeout: Seconds.

    Raises:
        NotFoundError: Nobody is there to be asked: it is no rosz node, or has just ended.
        WaitTimeout: It did not answer.
        RoszError: It refuses, or its answer makes no sense; the text says why.
    """
    key = control_key(node.domain, node.zid, node.node_id)
    replies = session.get(key, payload=msgspec.msgpack.encode(request), timeout=timeout)
    if not replies:
        raise NotFoundError(f"node '{node.node_name}' takes no questions: it is no rosz node")
    reply = replies[0]
    if reply.ok:
        try:
            return msgspec.msgpack.decode(reply.payload, type=answer)
        except msgspec.MsgspecError as error:
            raise RoszError(
                f"node '{node.node_name}' answers what makes no sense: {error}; is it of another"
                " version of rosz?"
            ) from error
    text = reply.payload.decode(errors="replace")
    if text == "Timeout":
        why = session.why_silent(node.zid) or "it hangs or is stopped"
        raise WaitTimeout(f"answer of node '{node.node_name}'", timeout, why)
    raise RoszError(text)


def ask_info(session: Session, node: Token, timeout: float = _TIMEOUT) -> NodeInfo:
    """Ask a node who it is; errors as those of `ask`."""
    return ask(session, node, Request("info"), NodeInfo, timeout)


def end(session: Session, node: Token, reason: str) -> None:
    """Have a node shut down, and wait until it is gone.

    Raises:
        NotFoundError: It is no rosz node, and takes no such wish.
        WaitTimeout: It did not answer, or answered and stayed.
        RoszError: It refuses.
    """
    gone = threading.Event()
    prefix = f"{tokens_key(node.domain, node.zid).removesuffix('**')}{node.node_id}/"

    def changed(key: str, alive: bool) -> None:
        if not alive and key.startswith(prefix):
            gone.set()

    watch = session.tokens(f"{prefix}{node.node_id}/NN/**", changed)
    try:
        ask(session, node, Request("shutdown", reason=reason), bool)
        if not gone.wait(_END_SECONDS):
            raise WaitTimeout(
                f"end of node '{node.node_name}'", _END_SECONDS, "it was told, and goes on"
            )
    finally:
        watch.close()


def get_levels(session: Session, node: Token) -> dict[str, str]:
    """Return the loggers of a node with their levels; errors as those of `ask`."""
    return ask(session, node, Request("levels"), dict[str, str])


def set_level(session: Session, node: Token, logger: str, level: str) -> None:
    """Set the level of a logger of a node; errors as those of `ask`."""
    ask(session, node, Request("set_level", logger=logger, level=level), bool)
