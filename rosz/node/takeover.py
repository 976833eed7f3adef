"""Two nodes of one name in a domain: the newer one takes over, and the older one shuts down.

ROS 1's master does the same.
"""

from __future__ import annotations

import time

import msgspec

from rosz.errors import RoszError
from rosz.lifecycle import Registration
from rosz.node.control import NodeInfo, Request, control_key
from rosz.node.core import NodeCore
from rosz.wire import ProcessToken
from rosz.worker import Worker

__all__ = ("yield_to_newer",)

_THREADS = 4
_REASON = "new node registered with same name"
_REPLY_TIMEOUT = 1.0
_TOGETHER = 0.2
"""Seconds between two starts below which the times in the tokens tell which node is newer."""


def yield_to_newer(node: NodeCore) -> None:
    """Shut a node down when a newer one of the same name appears."""
    duplicates = Worker[ProcessToken](
        f"rosz-takeover{node.name}", lambda other: _compare(node, other), threads=_THREADS
    )

    def appeared(other: ProcessToken, alive: bool) -> None:
        if alive and other.node == node.name and other != node.process:
            duplicates.submit(other)

    node.keep(Registration(lambda: duplicates.close(0)))
    namesakes = node.keep(node.context.graph.follow_processes(node.name))
    node.keep(Registration(namesakes.listen(appeared)))


def _compare(node: NodeCore, other: ProcessToken) -> None:
    """Shut a node down if another one of its name is newer."""
    if not node.is_shutdown and _is_newer(node, other):
        text = "shutdown request: [%s] Reason: %s (process %d on %s)"
        node.log.warning(text, node.name, _REASON, other.pid, other.host)
        node.shutdown(_REASON)


def _is_newer(node: NodeCore, other: ProcessToken) -> bool:
    """Return whether another node is newer, even if the clocks of the two machines differ."""
    key = control_key(other.domain, other.zid, other.node_id)
    request = msgspec.msgpack.encode(Request("info"))
    asked = time.monotonic()
    try:
        replies = node.context.session.get(key, payload=request, timeout=_REPLY_TIMEOUT)
        infos = [msgspec.msgpack.decode(r.payload, type=NodeInfo) for r in replies if r.ok]
    except (RoszError, msgspec.DecodeError):
        infos = []
    if infos:
        round_trip = time.monotonic() - asked
        lead = asked + round_trip / 2 - node.began - infos[0].age
        if abs(lead) > max(_TOGETHER, round_trip):
            return lead > 0
    # They started together, or the other one did not respond: compare the times in their tokens.
    return other.newer_than(node.process)
