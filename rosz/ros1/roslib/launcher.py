"""roslib.launcher: making a package importable."""

from __future__ import annotations

import sys
from pathlib import Path

from rosz.ros1.importer import MODULES
from rosz.ros1.rospkg import RosPack

__all__ = ("load_manifest",)

_PROVIDED = frozenset({*MODULES, "rclpy", "rosbag", "roscpp", "rosconsole", "rosout"})
"""Packages of ROS itself that are no folder here: what they have imports without them."""


def load_manifest(package_name: str, bootstrap_version: str = "0.7") -> None:  # noqa: ARG001  # ROS 1's
    """Put the Python folders of a package, and of those that it needs, on the module path.

    Messages need no folder: they import from anywhere.

    Args:
        package_name: The package that the program belongs to.
        bootstrap_version: Not used.

    Raises:
        ResourceNotFound: There is no package of that name.
    """
    if package_name in _PROVIDED:
        return
    packs = RosPack()
    packs.get_path(package_name)
    folders = [
        str(folder)
        for name in (package_name, *packs.get_depends(package_name))
        for folder in (Path(packs.get_path(name), "src"), Path(packs.get_path(name), "lib"))
        if folder.is_dir()
    ]
    sys.path[:0] = [folder for folder in folders if folder not in sys.path]
