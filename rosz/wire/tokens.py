"""Liveliness tokens: how nodes and endpoints make themselves known (rmw_zenoh).

``@ros2_lv/<domain>/<zid>/<nid>/<eid>/<kind>/<enclave>/<namespace>/<node>``, and for an endpoint
``…/<name>/<type>/<hash>/<qos>``, with every ``/`` inside a chunk written ``%``.
"""

from __future__ import annotations

from enum import Enum
from typing import Literal

import msgspec

from rosz.errors import DecodeError
from rosz.qos import QoS
from rosz.wire import qos as qos_text
from rosz.wire.keys import dds_type, ros_type

__all__ = ("Kind", "Token", "format_token", "parse_token", "tokens_key")

SPACE = "@ros2_lv"
_NODE_CHUNKS = 9
_ENDPOINT_CHUNKS = 13


class Kind(Enum):
    """What a token stands for."""

    NODE = "NN"
    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"
    SERVICE = "SS"
    CLIENT = "SC"


class Token(msgspec.Struct, frozen=True):
    """One node, or one endpoint of a node.

    Attributes:
        domain: The ROS domain.
        zid: Session that it lives in, lower-case hex.
        node_id: Number of the node within the session.
        entity_id: Number of the entity within the session; a node's is its ``node_id``.
        kind: What it is.
        namespace: Of the node: ``/`` or ``/robot1``.
        node: Base name of the node.
        enclave: Security enclave, ``/`` when there is none.
        name: Global name of the topic or service; empty for a node.
        type_name: ``pkg/msg/Name`` or ``pkg/srv/Name``; empty for a node.
        type_hash: ``RIHS01_…``; empty for a node.
        qos: Of the endpoint; ``None`` for a node.
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
        """Full name of the node."""
        return f"{self.namespace.rstrip('/')}/{self.node}"


def tokens_key(domain: int | Literal["*"], zid: str = "*") -> str:
    """Return the key expression that matches all tokens of a domain, or of one session in it."""
    return f"{SPACE}/{domain}/{zid}/**"


def format_token(token: Token) -> str:
    """Return the key of a token in canonical form: a QoS value that is the default is left out."""
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
    """Read a token.

    Raises:
        DecodeError: The key is no token that a reader of rmw_zenoh would accept.
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
    if len(chunks) < _ENDPOINT_CHUNKS:
        raise DecodeError("liveliness token", 0, f"'{key}' has {len(chunks)} chunks, expected 13")
    name, type_text, type_hash, qos = chunks[_NODE_CHUNKS:_ENDPOINT_CHUNKS]
    return msgspec.structs.replace(
        node_token,
        name="/" + _demangle(name).removeprefix("/"),  # some participants leave the slash out
        type_name=ros_type(type_text),
        type_hash=type_hash,
        qos=qos_text.parse_qos(qos),
    )


def _mangle(text: str) -> str:
    return text.replace("/", "%")


def _demangle(text: str) -> str:
    return text.replace("%", "/")
