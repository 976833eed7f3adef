"""Keys of topics and services, and the liveliness tokens of nodes and entities (rmw_zenoh).

``<domain>/<name>/<type>/<hash>`` carries the data of a topic or service. The keys of rosz begin
with ``@rosz/<domain>``, a verbatim chunk that the wildcards of ROS 2 tools never match.

rmw_zenoh declares ``@ros2_lv/<domain>/<zid>/<nid>/<eid>/<kind>/<enclave>/<namespace>/<node>`` for a
node, and for an entity the same with ``/<name>/<type>/<hash>/<qos>`` after it. A node of rosz also
declares its process and its start:
``@rosz/<domain>/node/<zid>/<nid>/<started>/<pid>/<host>/<full name>``. Every ``/`` inside a chunk
is written ``%``. The QoS is
``<reliability>:<durability>:<history>,<depth>:<deadline>:<lifespan>:<liveliness>,<lease>`` with
durations as ``seconds,nanoseconds``; a value that is the default is left empty.
"""

from __future__ import annotations

import re
from enum import Enum
from typing import Literal, TypeVar

import msgspec

from rosz.errors import DecodeError
from rosz.names import LONGEST_NAME
from rosz.qos import FOREVER, QoS

T = TypeVar("T")

SPACE = "@ros2_lv"
"""The first chunk of rmw_zenoh's tokens."""
NO_HASH = "TypeHashNotSupported"
"""The text that rmw_zenoh of ROS 2 Humble writes in place of a type hash."""

OWN_SPACE = "@rosz"
_NODE_CHUNKS = 9
_ENTITY_CHUNKS = 13
_PROCESS_CHUNKS = 9
_UNSAFE = re.compile(r"[^A-Za-z0-9._-]")
_FORBIDDEN = re.compile(r"[*$?#]")
_DEFAULT_DEPTH = 42
_SECOND = 1_000_000_000
_FOREVER = divmod(FOREVER, _SECOND)
_RELIABLE, _BEST_EFFORT = 1, 2
_TRANSIENT_LOCAL, _VOLATILE = 1, 2
_KEEP_LAST, _KEEP_ALL = 1, 2
_AUTOMATIC, _MANUAL_BY_TOPIC = 1, 3
_FIELDS_PER_PART = (1, 1, 2, 2, 2, 3)


def dds_type(type_name: str) -> str:
    """Return ``std_msgs::msg::dds_::String_`` for ``std_msgs/msg/String``."""
    *space, base = type_name.split("/")
    return f"{'::'.join(space)}::dds_::{base}_"


def ros_type(dds: str) -> str:
    """Return ``std_msgs/msg/String`` for ``std_msgs::msg::dds_::String_``.

    Raises:
        DecodeError: The text has another form.
    """
    space, separator, base = dds.rpartition("::dds_::")
    if not separator or not base.endswith("_"):
        raise DecodeError("type chunk", 0, f"'{dds}', expected 'package::msg::dds_::Name_'")
    return f"{space.replace('::', '/')}/{base[:-1]}"


def entity_key(domain: int, name: str, type_name: str, type_hash: str) -> str:
    """Return the key expression of the samples of a topic, or of the queries of a service.

    Args:
        domain: The ROS domain.
        name: The global name, such as ``/robot1/scan``, or ``/**`` for all topics.
        type_name: The full type name, ``pkg/msg/Name`` or ``pkg/srv/Name``, or ``*`` for any.
        type_hash: The type hash ``RIHS01_…``, `NO_HASH`, or ``*`` for any.
    """
    kind = "*" if type_name == "*" else dds_type(type_name)
    return f"{domain}/{name.strip('/')}/{kind}/{type_hash}"


def own_key(domain: int, *chunks: str) -> str:
    """Return a key of rosz itself."""
    return "/".join((OWN_SPACE, str(domain), *chunks))


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


def entities_key(domain: int, kind: Kind, name: str) -> str:
    """Return a key expression for the tokens of one kind of entity of a topic or service.

    It also matches longer names with this end: some participants leave out the first slash.
    """
    return f"{SPACE}/{domain}/*/*/*/{kind.value}/*/*/*/$*{_chunk(name).lstrip('%') or '_'}/**"


def clients_below_key(domain: int, node: str) -> str:
    """Return the key expression of the tokens of clients of services in a node's namespace."""
    return f"{SPACE}/{domain}/*/*/*/{Kind.CLIENT.value}/*/*/*/{_chunk(node)}%$*/**"


def node_key(domain: int, node: str) -> str:
    """Return the key expression of all tokens of the nodes of a full name."""
    namespace, _, base = node.rpartition("/")
    return f"{SPACE}/{domain}/*/*/*/*/*/{_chunk(namespace or '/')}/{_chunk(base)}/**"


def nodes_key(domain: int, zid: str = "*") -> str:
    """Return the key expression of the tokens of nodes, without those of their entities.

    Args:
        domain: The ROS domain.
        zid: The session of the nodes; it may have wildcards.
    """
    return f"{SPACE}/{domain}/{zid}/*/*/{Kind.NODE.value}/**"


def _chunk(name: str) -> str:
    """Return a chunk that matches a name; characters that no token may have become ``_``."""
    return _FORBIDDEN.sub("_", name.replace("/", "%")) or "%"


def format_token(token: Token) -> str:
    """Return the key of a token in canonical form, which leaves out default QoS values."""
    chunks = [
        SPACE,
        str(token.domain),
        token.zid,
        str(token.node_id),
        str(token.entity_id),
        token.kind.value,
        token.enclave.replace("/", "%"),
        token.namespace.replace("/", "%"),
        token.node,
    ]
    if token.qos is not None:
        chunks += [
            token.name.replace("/", "%"),
            dds_type(token.type_name),
            token.type_hash,
            format_qos(token.qos),
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
    if "" in chunks or not {"*", "\n"}.isdisjoint(key):
        reason = "has an empty chunk, a line feed, or a wildcard"
        raise DecodeError("liveliness token", 0, f"{key!r:.300} {reason}")
    _, domain, zid, node_id, entity_id, kind, enclave, namespace, node = chunks[:_NODE_CHUNKS]
    try:
        token = Token(
            domain=int(domain),
            zid=zid,
            node_id=int(node_id),
            entity_id=int(entity_id),
            kind=Kind(kind),
            namespace=namespace.replace("%", "/"),
            node=node,
            enclave=enclave.replace("%", "/"),
        )
    except ValueError as error:
        raise DecodeError("liveliness token", 0, f"'{key}': {error}") from error
    if token.kind is Kind.NODE:
        return token
    if len(chunks) < _ENTITY_CHUNKS:
        raise DecodeError("liveliness token", 0, f"'{key}' has {len(chunks)} chunks, expected 13")
    name, type_text, type_hash, qos = chunks[_NODE_CHUNKS:_ENTITY_CHUNKS]
    name = "/" + name.replace("%", "/").removeprefix("/")  # some leave the first slash out
    if name.endswith("/") or "//" in name or len(name.encode()) > LONGEST_NAME:
        raise DecodeError("liveliness token", 0, f"'{key}': no endpoint can have this name")
    return msgspec.structs.replace(
        token,
        name=name,
        type_name=ros_type(type_text),
        type_hash=type_hash,
        qos=parse_qos(qos),
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


def dropped_key(domain: int, zid: str = "*") -> str:
    """Return the key of the dropped samples of one session, or of all sessions."""
    return own_key(domain, "dropped", zid)


def processes_key(domain: int, node: str | None = None) -> str:
    """Return the key expression of all process tokens of a domain, or of nodes of a full name."""
    if node is None:
        return own_key(domain, "node", "**")
    return own_key(domain, "node", *"*****", _chunk(node))


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


def format_qos(qos: QoS) -> str:
    """Return the chunk of a QoS, without default values."""
    lease = _duration(qos.lease)
    return ":".join(
        (
            "" if qos.reliable else str(_BEST_EFFORT),
            str(_TRANSIENT_LOCAL) if qos.latched else "",
            ("" if qos.history == "keep_last" else str(_KEEP_ALL))
            + ","
            + ("" if qos.depth in {0, _DEFAULT_DEPTH} else str(qos.depth)),
            _duration(qos.deadline),
            _duration(qos.lifespan),
            ("" if qos.liveliness == "automatic" else str(_MANUAL_BY_TOPIC)) + "," + lease,
        )
    )


def parse_qos(chunk: str) -> QoS:
    """Parse a chunk; values that mean "the system's choice" become the defaults.

    Raises:
        DecodeError: The chunk has another form, or a number without a meaning.
    """
    parts = [part.split(",") for part in chunk.split(":")]
    if tuple(map(len, parts)) != _FIELDS_PER_PART:
        raise DecodeError(
            "QoS chunk", 0, f"'{chunk}', expected the form 'r:d:h,n:s,ns:s,ns:l,s,ns'"
        )
    (rel,), (dur,), (hist, depth), deadline, lifespan, (live, *lease) = parts
    try:
        return QoS(
            depth=_number(depth, _DEFAULT_DEPTH),
            reliability=_RELIABILITY[_number(rel, _RELIABLE)],
            durability=_DURABILITY[_number(dur, _VOLATILE)],
            history=_HISTORY[_number(hist, _KEEP_LAST)],
            deadline=_nanoseconds(deadline),
            lifespan=_nanoseconds(lifespan),
            liveliness=_LIVELINESS[_number(live, _AUTOMATIC)],
            lease=_nanoseconds(lease),
        )
    except (ValueError, KeyError) as error:
        raise DecodeError(
            "QoS chunk", 0, f"'{chunk}' has a value that is not known: {error}"
        ) from error


def _codes(default: T, codes: tuple[int, ...], others: dict[int, T]) -> dict[int, T]:
    return dict.fromkeys(codes, default) | others


# 0 is the system's default, 3 unknown, 4 and 5 best available: all of them mean the default.
_RELIABILITY: dict[int, Literal["reliable", "best_effort"]] = _codes(
    "reliable", (0, _RELIABLE, 3, 4), {_BEST_EFFORT: "best_effort"}
)
_DURABILITY: dict[int, Literal["volatile", "transient_local"]] = _codes(
    "volatile", (0, _VOLATILE, 3, 4), {_TRANSIENT_LOCAL: "transient_local"}
)
_HISTORY: dict[int, Literal["keep_last", "keep_all"]] = _codes(
    "keep_last", (0, _KEEP_LAST, 3), {_KEEP_ALL: "keep_all"}
)
_LIVELINESS: dict[int, Literal["automatic", "manual_by_topic"]] = _codes(
    "automatic", (0, _AUTOMATIC, 4, 5), {_MANUAL_BY_TOPIC: "manual_by_topic"}
)


def _number(text: str, default: int) -> int:
    return int(text) if text else default


def _duration(nanoseconds: int) -> str:
    seconds, rest = _FOREVER if nanoseconds == 0 else divmod(nanoseconds, _SECOND)
    return ",".join(
        "" if value == forever else str(value)
        for value, forever in zip((seconds, rest), _FOREVER, strict=True)
    )


def _nanoseconds(fields: list[str]) -> int:
    seconds, rest = (_number(text, forever) for text, forever in zip(fields, _FOREVER, strict=True))
    return seconds * _SECOND + rest
