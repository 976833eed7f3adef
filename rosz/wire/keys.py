"""Key expressions of topics and services (rmw_zenoh), and rosz's own.

``<domain>/<name>/<type>/<hash>`` carries the data of a topic or service. What belongs to rosz lies
under ``@rosz/<domain>/…``: a verbatim chunk, which the wildcards of ROS 2 tools never match.
"""

from __future__ import annotations

from rosz.errors import DecodeError

__all__ = (
    "NO_HASH",
    "OWN_SPACE",
    "dds_type",
    "endpoint_key",
    "own_key",
    "ros_type",
)

NO_HASH = "TypeHashNotSupported"
"""What rmw_zenoh of ROS 2 Humble writes in place of a type hash."""

OWN_SPACE = "@rosz"


def dds_type(type_name: str) -> str:
    """Turn ``std_msgs/msg/String`` into ``std_msgs::msg::dds_::String_``."""
    *space, base = type_name.split("/")
    return f"{'::'.join(space)}::dds_::{base}_"


def ros_type(dds: str) -> str:
    """Turn ``std_msgs::msg::dds_::String_`` into ``std_msgs/msg/String``.

    Raises:
        DecodeError: The text has not that form.
    """
    space, separator, base = dds.rpartition("::dds_::")
    if not separator or not base.endswith("_"):
        raise DecodeError("type chunk", 0, f"'{dds}', expected 'package::msg::dds_::Name_'")
    return f"{space.replace('::', '/')}/{base[:-1]}"


def endpoint_key(domain: int, name: str, type_name: str, type_hash: str) -> str:
    """Return the key expression on which a topic's samples or a service's queries travel.

    Args:
        domain: The ROS domain.
        name: Global name, such as ``/robot1/scan``; for a reader of all topics also ``/**``.
        type_name: Full type name, ``pkg/msg/Name`` or ``pkg/srv/Name``, or ``*`` for any.
        type_hash: ``RIHS01_…``, `NO_HASH`, or ``*`` for any.
    """
    kind = "*" if type_name == "*" else dds_type(type_name)
    return f"{domain}/{name.strip('/')}/{kind}/{type_hash}"


def own_key(domain: int, *chunks: str) -> str:
    """Return a key of rosz's own space."""
    return "/".join((OWN_SPACE, str(domain), *chunks))
