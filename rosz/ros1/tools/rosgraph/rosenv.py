"""rosgraph.rosenv: the environment variables of ROS 1."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from rosz.ros1.state import find_option

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

    Raises:
        ValueError: ``__master:=`` has no value, or more than one.
    """
    given = find_option("__master:=", argv)
    if given is not None:
        if not given or ":=" in given:
            raise ValueError(f"expected one URI behind '__master:=', got '{given}'")
        return given
    variables = os.environ if env is None else env
    return variables.get(ROS_MASTER_URI, DEFAULT_MASTER_URI)
