"""The tokens that rosz nodes declare beside rmw_zenoh's: which process a node is, and since when.

``@rosz/<domain>/node/<zid>/<nid>/<started>/<pid>/<host>/<full name>``, with every ``/`` inside a
chunk written ``%``.
"""

from __future__ import annotations

import re

import msgspec

from rosz.errors import DecodeError
from rosz.wire.keys import own_key

__all__ = ("ProcessToken", "format_process", "parse_process", "processes_key")

_CHUNKS = 9
_UNSAFE = re.compile(r"[^A-Za-z0-9._-]")


class ProcessToken(msgspec.Struct, frozen=True):
    """A node, as the process that it is.

    Attributes:
        domain: The ROS domain.
        zid: Session that it lives in.
        node_id: Number of the node within the session.
        started: Nanoseconds since the Unix epoch, by the session's hybrid clock.
        pid: Process id on its host.
        host: Host name.
        node: Full name.
    """

    domain: int
    zid: str
    node_id: int
    started: int
    pid: int
    host: str
    node: str

    def newer_than(self, other: ProcessToken) -> bool:
        """Tell which of two nodes came later; the same on whichever machine it is asked."""
        return (self.started, self.zid, self.node_id) > (other.started, other.zid, other.node_id)


def processes_key(domain: int) -> str:
    """Return the key expression that matches all of them in a domain."""
    return own_key(domain, "node", "**")


def format_process(token: ProcessToken) -> str:
    """Return the key of a token."""
    return own_key(
        token.domain,
        "node",
        token.zid,
        str(token.node_id),
        str(token.started),
        str(token.pid),
        _UNSAFE.sub("_", token.host) or "_",
        token.node.replace("/", "%"),
    )


def parse_process(key: str) -> ProcessToken:
    """Read a token.

    Raises:
        DecodeError: The key has another form.
    """
    chunks = key.split("/")
    if len(chunks) != _CHUNKS:
        raise DecodeError(
            "process token", 0, f"'{key}' has {len(chunks)} chunks, expected {_CHUNKS}"
        )
    try:
        _, domain, _, zid, node_id, started, pid, host, node = chunks
        return ProcessToken(
            int(domain), zid, int(node_id), int(started), int(pid), host, node.replace("%", "/")
        )
    except ValueError as error:
        raise DecodeError("process token", 0, f"'{key}': {error}") from error
