"""The keys, tokens and attachments of ROS 2's rmw_zenoh, and the endpoints of Zenoh; pure."""

from rosz.wire.attachment import pack_attachment, read_attachment
from rosz.wire.endpoint import Endpoint
from rosz.wire.gid import gid
from rosz.wire.tokens import (
    NO_HASH,
    OWN_SPACE,
    SPACE,
    Kind,
    ProcessToken,
    Token,
    dds_type,
    dropped_key,
    entity_key,
    format_process,
    format_qos,
    format_token,
    own_key,
    parse_process,
    parse_qos,
    parse_token,
    processes_key,
    ros_type,
    tokens_key,
)

__all__ = (
    "NO_HASH",
    "OWN_SPACE",
    "SPACE",
    "Endpoint",
    "Kind",
    "ProcessToken",
    "Token",
    "dds_type",
    "dropped_key",
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
)
