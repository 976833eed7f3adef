"""rosgraph.rosenv: the environment variables of ROS 1."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence

__all__ = (
    "DEFAULT_MASTER_PORT",
    "DEFAULT_MASTER_URI",
    "ROS_HOSTNAME",
    "ROS_IP",
    "ROS_IPV6",
    "ROS_MASTER_URI",
    "ROS_NAMESPACE",
    "get_master_uri",
)

ROS_MASTER_URI = "ROS_MASTER_URI"
ROS_IP = "ROS_IP"
ROS_IPV6 = "ROS_IPV6"
ROS_HOSTNAME = "ROS_HOSTNAME"
ROS_NAMESPACE = "ROS_NAMESPACE"
DEFAULT_MASTER_PORT = 11311
DEFAULT_MASTER_URI = f"http://localhost:{DEFAULT_MASTER_PORT}/"


def get_master_uri(
    env: Mapping[str, str] | None = None, argv: Sequence[str] | None = None
) -> str | None:
    """Return the URI of the master: ``__master:=``, ``ROS_MASTER_URI`` or ROS 1's default.

    Programs print it; nothing in rosz uses it.

    Args:
        env: Environment variables; those of the process when not given.
        argv: Command line; that of the process when not given.
    """
    for word in sys.argv if argv is None else argv:
        if word.startswith("__master:="):
            return word.partition(":=")[2] or None
    variables = os.environ if env is None else env
    return variables.get(ROS_MASTER_URI, DEFAULT_MASTER_URI) or DEFAULT_MASTER_URI
