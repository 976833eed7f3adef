"""The keys, tokens and attachments of ROS 2's rmw_zenoh, and the endpoints of Zenoh; pure."""

from rosz.wire.attachment import (
    Attachment,
    pack_attachment,
    read_attachment,
    unpack_attachment,
)
from rosz.wire.endpoint import Endpoint
from rosz.wire.gid import gid
from rosz.wire.keys import NO_HASH, OWN_SPACE, dds_type, entity_key, own_key, ros_type
from rosz.wire.qos import format_qos, parse_qos
from rosz.wire.tokens import (
    SPACE,
    Kind,
    ProcessToken,
    Token,
    format_process,
    format_token,
    parse_process,
    parse_token,
    processes_key,
    tokens_key,
)

__all__ = (
    "NO_HASH",
    "OWN_SPACE",
    "SPACE",
    "Attachment",
    "Endpoint",
    "Kind",
    "ProcessToken",
    "Token",
    "dds_type",
    "entity_key",
    "format_process",
    "format_qos",
    "format_token",
    "gid",
    "own_key",
    "pack_attachment",
    "parse_process",
    "parse_qos",
    "parse_token",
    "processes_key",
    "read_attachment",
    "ros_type",
    "tokens_key",
    "unpack_attachment",
)
