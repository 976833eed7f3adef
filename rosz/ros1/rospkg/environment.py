"""rospkg's view of the environment variables of ROS 1."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from rosz.ros1.importer import package_path

__all__ = (
    "get_etc_ros_dir",
    "get_log_dir",
    "get_ros_home",
    "get_ros_package_path",
    "get_ros_paths",
    "get_ros_root",
    "get_test_results_dir",
    "on_ros_path",
)

Variables = Mapping[str, str] | None


def _get(env: Variables, name: str, default: str) -> str:
    return (os.environ if env is None else env).get(name, default)


def get_ros_root(env: Variables = None) -> str | None:
    """Return ``ROS_ROOT``; None where it is not set."""
    return (os.environ if env is None else env).get("ROS_ROOT")


def get_ros_package_path(env: Variables = None) -> str:
    """Return ``ROS_PACKAGE_PATH``, empty where it is not set."""
    return _get(env, "ROS_PACKAGE_PATH", "")


def get_ros_paths(env: Variables = None) -> list[str]:
    """Return the folders that packages are looked for in, first ones first.

    Args:
        env: Variables to read ``ROS_PACKAGE_PATH`` from; when not given, all that rosz searches.
    """
    if env is None:
        return [str(root) for root in package_path().roots]
    return [part for part in get_ros_package_path(env).split(os.pathsep) if part]


def get_ros_home(env: Variables = None) -> str:
    """Return ``ROS_HOME`` or ``~/.ros``."""
    return _get(env, "ROS_HOME", str(Path("~/.ros").expanduser()))


def get_log_dir(env: Variables = None) -> str:
    """Return ``ROS_LOG_DIR`` or ``log`` in ROS's home."""
    return _get(env, "ROS_LOG_DIR", str(Path(get_ros_home(env), "log")))


def get_test_results_dir(env: Variables = None) -> str:
    """Return ``ROS_TEST_RESULTS_DIR`` or ``test_results`` in ROS's home."""
    return _get(env, "ROS_TEST_RESULTS_DIR", str(Path(get_ros_home(env), "test_results")))


def get_etc_ros_dir(env: Variables = None) -> str:
    """Return ``ROS_ETC_DIR`` or ``/etc/ros``."""
    return _get(env, "ROS_ETC_DIR", "/etc/ros")


def on_ros_path(p: str, env: Variables = None) -> bool:
    """Tell whether a file or folder lies in one that packages are looked for in."""
    here = Path(p).resolve()
    return any(here.is_relative_to(Path(root).resolve()) for root in get_ros_paths(env))
