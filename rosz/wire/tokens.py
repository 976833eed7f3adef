"""Liveliness tokens, by which nodes and their entities announce themselves.

rmw_zenoh declares ``@ros2_lv/<domain>/<zid>/<nid>/<eid>/<kind>/<enclave>/<namespace>/<node>`` for a
node, and for an entity the same with ``/<name>/<type>/<hash>/<qos>`` after it. rosz nodes also
declare which process they are, and since when:
``@rosz/<domain>/node/<zid>/<nid>/<started>/<pid>/<host>/<full name>``. Every ``/`` inside a chunk
is written ``%``.
"""

from __future__ import annotations

import re
from enum import Enum
from typing import Literal

import msgspec

from rosz.errors import DecodeError
from rosz.qos import QoS
from rosz.wire import qos as qos_text
from rosz.wire.keys import dds_type, own_key, ros_type

__all__ = (
    "Kind",
    "ProcessToken",
    "Token",
    "format_process",
    "format_token",
    "parse_process",
    "parse_token",
    "processes_key",
    "tokens_key",
)

SPACE = "@ros2_lv"
_NODE_CHUNKS = 9
_ENTITY_CHUNKS = 13
_PROCESS_CHUNKS = 9
_UNSAFE = re.compile(r"[^A-Za-z0-9._-]")


class Kind(Enum):
    """The kinds of tokens."""

    NODE = "NN"
    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"
    SERVICE = "SS"
    CLIENT = "SC"


class Token(msgspec.Struct, frozen=True):
    """One node, or one entity of a node.

    Attributes:
        domain: The ROS domain.
        zid: The session of the node, in lower-case hex.
        node_id: The number of the node within the session.
        entity_id: The number of the entity within the session; for a node, its ``node_id``.
        kind: The kind of the token.
        namespace: The namespace of the node, such as ``/`` or ``/robot1``.
        node: The base name of the node.
        enclave: The security enclave, ``/`` when there is none.
        name: The global name of the topic or service; empty for a node.
        type_name: The type, ``pkg/msg/Name`` or ``pkg/srv/Name``; empty for a node.
        type_hash: The type hash, ``RIHS01_…``; empty for a node.
        qos: The QoS of the entity; ``None`` for a node.
    """

    domain: int
    zid: str
    node_id: int
    entity_id: int
    kind: Kind
    namespace: str
    node: str
    enclave: str = "/"
    name: str = ""
    type_name: str = ""
    type_hash: str = ""
    qos: QoS | None = None

    @property
    def node_name(self) -> str:
        """The full name of the node."""
        return f"{self.namespace.rstrip('/')}/{self.node}"


def tokens_key(domain: int | Literal["*"], zid: str = "*") -> str:
    """Return the key expression that matches all tokens of a domain, or of one session in it."""
    return f"{SPACE}/{domain}/{zid}/**"


def format_token(token: Token) -> str:
    """Return the key of a token in canonical form, which leaves out default QoS values."""
    chunks = [
        SPACE,
        str(token.domain),
        token.zid,
        str(token.node_id),
        str(token.entity_id),
        token.kind.value,
        _mangle(token.enclave),
        _mangle(token.namespace),
        token.node,
    ]
    if token.qos is not None:
        chunks += [
            _mangle(token.name),
            dds_type(token.type_name),
            token.type_hash,
            qos_text.format_qos(token.qos),
        ]
    return "/".join(chunks)


def parse_token(key: str) -> Token:
    """Parse the key of a token.

    Raises:
        DecodeError: rmw_zenoh would not accept the key as a token.
    """
    chunks = key.split("/")
    if len(chunks) < _NODE_CHUNKS or chunks[0] != SPACE:
        raise DecodeError(
            "liveliness token", 0, f"'{key}' has {len(chunks)} chunks, expected 9 or 13"
        )
    if "" in chunks:
        raise DecodeError("liveliness token", 0, f"'{key}' has an empty chunk")
    _, domain, zid, node_id, entity_id, kind_text, enclave, namespace, node = chunks[:_NODE_CHUNKS]
    try:
        kind = Kind(kind_text)
        numbers = int(domain), int(node_id), int(entity_id)
    except ValueError as error:
        raise DecodeError("liveliness token", 0, f"'{key}': {error}") from error
    node_token = Token(
        numbers[0],
        zid,
        numbers[1],
        numbers[2],
        kind,
        _demangle(namespace),
        node,
        _demangle(enclave),
    )
    if kind is Kind.NODE:
        return node_token
    if len(chunks) < _ENTITY_CHUNKS:
        raise DecodeError("liveliness token", 0, f"'{key}' has {len(chunks)} chunks, expected 13")
    name, type_text, type_hash, qos = chunks[_NODE_CHUNKS:_ENTITY_CHUNKS]
    return msgspec.structs.replace(
        node_token,
        name="/" + _demangle(name).removeprefix("/"),  # some participants leave the slash out
        type_name=ros_type(type_text),
        type_hash=type_hash,
        qos=qos_text.parse_qos(qos),
    )


class ProcessToken(msgspec.Struct, frozen=True):
    """The process of a rosz node.

    Attributes:
        domain: The ROS domain.
        zid: The session of the node.
        node_id: The number of the node within the session.
        started: The start of the node, in nanoseconds since the Unix epoch, by the session's clock.
        pid: The process id on the host.
        host: The host name.
        node: The full name of the node.
    """

    domain: int
    zid: str
    node_id: int
    started: int
    pid: int
    host: str
    node: str

    def newer_than(self, other: ProcessToken) -> bool:
        """Tell whether this node started after another; the answer is the same on every machine."""
        return (self.started, self.zid, self.node_id) > (other.started, other.zid, other.node_id)


def processes_key(domain: int) -> str:
    """Return the key expression that matches all process tokens of a domain."""
    return own_key(domain, "node", "**")


def format_process(token: ProcessToken) -> str:
    """Return the key of a process token."""
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
    """Parse the key of a process token.

    Raises:
        DecodeError: The key has another form.
    """
    chunks = key.split("/")
    if len(chunks) != _PROCESS_CHUNKS:
        raise DecodeError(
            "process token", 0, f"'{key}' has {len(chunks)} chunks, expected {_PROCESS_CHUNKS}"
        )
    try:
        _, domain, _, zid, node_id, started, pid, host, node = chunks
        return ProcessToken(
            int(domain), zid, int(node_id), int(started), int(pid), host, node.replace("%", "/")
        )
    except ValueError as error:
        raise DecodeError("process token", 0, f"'{key}': {error}") from error


def _mangle(text: str) -> str:
    return text.replace("/", "%")


def _demangle(text: str) -> str:
    return text.replace("%", "/")
