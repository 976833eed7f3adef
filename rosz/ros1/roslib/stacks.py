"""roslib.stacks: stacks of rosbuild, folders with a ``stack.xml``."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from rosz.ros1.roslib import stack_manifest
from rosz.ros1.roslib.packages import get_pkg_dir
from rosz.ros1.rospkg import (
    STACK_FILE,
    ResourceNotFound,
    RosPack,
    RosStack,
    get_ros_paths,
    list_by_path,
)

__all__ = (
    "ROS_STACK",
    "STACK_FILE",
    "InvalidROSStackException",
    "ROSStackException",
    "expand_to_packages",
    "get_stack_dir",
    "get_stack_version",
    "get_stack_version_by_dir",
    "list_stacks",
    "list_stacks_by_path",
    "stack_of",
)

ROS_STACK = "ros"
_CMAKE_VERSION = re.compile(r"^\s*rosbuild_make_distribution\(\s*([^)\s]+)\s*\)", re.MULTILINE)

Variables = Mapping[str, str] | None
"""Environment variables; None for those of the process."""


class ROSStackException(Exception):
    """Base class of the errors of stacks."""


class InvalidROSStackException(ROSStackException):
    """The stack does not exist."""


def _stacks(env: Variables) -> RosStack:
    return RosStack(get_ros_paths(os.environ if env is None else env))


def list_stacks(env: Variables = None) -> list[str]:
    """Return the names of all stacks.

    Args:
        env: Variables to read ``ROS_PACKAGE_PATH`` from; those of the process when not given.
    """
    return _stacks(env).list()


def list_stacks_by_path(
    path: str, stacks: list[str] | None = None, cache: dict[str, str] | None = None
) -> list[str]:
    """Add the names of the stacks in a folder to a list, and return it.

    Args:
        path: The folder.
        stacks: List to extend; a new one when not given.
        cache: Dict that gets the folders of the stacks by their names.
    """
    found = [] if stacks is None else stacks
    folders = list_by_path(STACK_FILE, path)
    found += [name for name in folders if name not in found]
    if cache is not None:
        cache.update(folders)
    return found


def get_stack_dir(stack: str, env: Variables = None) -> str:
    """Return the folder of a stack.

    Args:
        stack: Name of the stack.
        env: Variables to read ``ROS_PACKAGE_PATH`` from; those of the process when not given.

    Raises:
        InvalidROSStackException: The stack does not exist.
    """
    try:
        return _stacks(env).get_path(stack)
    except ResourceNotFound as error:
        raise InvalidROSStackException(stack) from error


def stack_of(pkg: str, env: Variables = None) -> str | None:  # noqa: ARG001  # ROS 1's
    """Return the name of the stack that a package lies in; None if it lies in none.

    Raises:
        InvalidROSPkgException: The package does not exist.
    """
    above = Path(get_pkg_dir(pkg) or "", STACK_FILE).parents
    return next((folder.name for folder in above if (folder / STACK_FILE).is_file()), None)


def expand_to_packages(names: Sequence[str], env: Variables = None) -> tuple[list[str], list[str]]:
    """Return the packages that names of packages and stacks stand for, and the names of neither.

    Args:
        names: Names of packages and stacks.
        env: Variables to read ``ROS_PACKAGE_PATH`` from; those of the process when not given.

    Raises:
        ValueError: The names are a text.
    """
    if isinstance(names, str):
        raise ValueError("names must be a list of strings")  # noqa: TRY004  # ROS 1's
    packages = set(RosPack(None if env is None else get_ros_paths(env)).list())
    stacks = _stacks(env)
    known = set(stacks.list())
    found: list[str] = []
    unknown: list[str] = []
    for name in names:
        if name in packages:
            found.append(name)
        elif name in known:
            found += stacks.packages_of(name)
        else:
            unknown.append(name)
    return found, unknown


def get_stack_version(stack: str, env: Variables = None) -> str | None:
    """Return the version of a stack; None if it has none.

    Args:
        stack: Name of the stack.
        env: Variables to read ``ROS_PACKAGE_PATH`` from; those of the process when not given.

    Raises:
        InvalidROSStackException: The stack does not exist.
    """
    return get_stack_version_by_dir(get_stack_dir(stack, env))


def get_stack_version_by_dir(stack_dir: str) -> str | None:
    """Return the version of the stack in a folder: that of ``stack.xml``, or of CMakeLists.txt."""
    manifest = Path(stack_dir, STACK_FILE)
    if manifest.is_file():
        version = stack_manifest.parse_file(str(manifest)).version
        if version:
            return version
    recipe = Path(stack_dir, "CMakeLists.txt")
    found = _CMAKE_VERSION.search(recipe.read_text("utf-8")) if recipe.is_file() else None
    return found and found[1]
