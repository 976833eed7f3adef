"""The text and bytes that rosz shares with ROS 2's rmw_zenoh; pure."""

from rosz.wire.attachment import Attachment, pack, read, unpack
from rosz.wire.endpoint import Endpoint
from rosz.wire.gid import gid
from rosz.wire.keys import NO_HASH, OWN_SPACE, dds_type, endpoint_key, own_key, ros_type
from rosz.wire.processes import ProcessToken, format_process, parse_process, processes_key
from rosz.wire.qos import format_qos, parse_qos
from rosz.wire.tokens import Kind, Token, format_token, parse_token, tokens_key

__all__ = (
    "NO_HASH",
    "OWN_SPACE",
    "Attachment",
    "Endpoint",
    "Kind",
    "ProcessToken",
    "Token",
    "dds_type",
    "endpoint_key",
    "format_process",
    "format_qos",
    "format_token",
    "gid",
    "own_key",
    "pack",
    "parse_process",
    "parse_qos",
    "parse_token",
    "processes_key",
    "read",
    "ros_type",
    "tokens_key",
    "unpack",
)
