"""The keys, tokens and attachments of ROS 2's rmw_zenoh, and the endpoints of Zenoh; pure."""

from rosz.wire.endpoint import Endpoint
from rosz.wire.ids import (
    FOREIGN_DIGITS,
    gid,
    host_number,
    id_prefix,
    is_rosz_id,
    pack_attachment,
    read_attachment,
)
from rosz.wire.tokens import (
    NO_HASH,
    OWN_SPACE,
    SPACE,
    Kind,
    ProcessToken,
    Token,
    clients_below_key,
    dds_type,
    dropped_key,
    entities_key,
    entity_key,
    format_process,
    format_qos,
    format_token,
    node_key,
    nodes_key,
    own_key,
    parse_process,
    parse_qos,
    parse_token,
    processes_key,
    ros_type,
    tokens_key,
)
