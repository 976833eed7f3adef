"""roslib.rosenv: environment variables of ROS 1, which may be required."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from rosz.ros1.rosgraph import names
from rosz.ros1.rosgraph.names import ROS_HOSTNAME, ROS_IP, ROS_MASTER_URI, ROS_NAMESPACE
from rosz.ros1.rosgraph.roslogging import makedirs_with_parent_perms
from rosz.ros1.roslib.packages import ROSEnvException
from rosz.ros1.rospkg import (
    ROS_HOME,
    ROS_LOG_DIR,
    ROS_PACKAGE_PATH,
    ROS_ROOT,
    get_log_dir,
    get_ros_home,
    get_test_results_dir,
)

__all__ = (
    "ROS_HOME",
    "ROS_HOSTNAME",
    "ROS_IP",
    "ROS_LOG_DIR",
    "ROS_MASTER_URI",
    "ROS_NAMESPACE",
    "ROS_PACKAGE_PATH",
    "ROS_ROOT",
    "ROSEnvException",
    "get_log_dir",
    "get_master_uri",
    "get_ros_home",
    "get_ros_package_path",
    "get_ros_root",
    "get_test_results_dir",
    "makedirs_with_parent_perms",
)

Variables = Mapping[str, str] | None
"""Environment variables; None for those of the process."""


def _get(name: str, required: bool, env: Variables) -> str | None:
    value = (os.environ if env is None else env).get(name)
    if value is None and required:
        raise ROSEnvException(f"{name} has not been configured")
    return value


def get_ros_root(required: bool = True, env: Variables = None) -> str | None:
    """Return ``ROS_ROOT``.

    Args:
        required: Whether to raise an error if it is not set; otherwise return None.
        env: Environment variables; those of the process when not given.

    Raises:
        ROSEnvException: It is not set.
    """
    return _get(ROS_ROOT, required, env)


def get_ros_package_path(required: bool = False, env: Variables = None) -> str | None:
    """Return ``ROS_PACKAGE_PATH``; see `get_ros_root`."""
    return _get(ROS_PACKAGE_PATH, required, env)


def get_master_uri(
    required: bool = True, env: Variables = None, argv: Sequence[str] | None = None
) -> str | None:
    """Return ``__master:=`` of the command line, or ``ROS_MASTER_URI``.

    Programs print it; nothing in rosz uses it.

    Args:
        required: Whether to raise an error if neither is set; otherwise return None.
        env: Environment variables; those of the process when not given.
        argv: Command line; that of the process when not given.

    Raises:
        ROSEnvException: Neither is set, or ``__master:=`` has no value or more than one.
    """
    try:
        given = names.get_master_uri({ROS_MASTER_URI: ""}, argv)
    except ValueError as error:
        raise ROSEnvException(str(error)) from error
    return given or _get(ROS_MASTER_URI, required, env)
