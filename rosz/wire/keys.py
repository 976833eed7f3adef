"""Key expressions of topics and services (rmw_zenoh), and rosz's own.

``<domain>/<name>/<type>/<hash>`` carries the data of a topic or service. The keys of rosz begin
with ``@rosz/<domain>``, a verbatim chunk that the wildcards of ROS 2 tools never match.
"""

from __future__ import annotations

from rosz.errors import DecodeError

__all__ = (
    "NO_HASH",
    "OWN_SPACE",
    "dds_type",
    "entity_key",
    "own_key",
    "ros_type",
)

NO_HASH = "TypeHashNotSupported"
"""The text that rmw_zenoh of ROS 2 Humble writes in place of a type hash."""

OWN_SPACE = "@rosz"


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
