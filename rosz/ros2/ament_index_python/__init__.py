"""ament_index_python: where packages lie, as ROS 2's programs ask for it.

There is no install space: the share folder of a package is its folder on the package path.
"""

from rosz.ros2.ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
    get_package_share_path,
    get_packages_with_prefixes,
)

PUBLIC_MODULES = ("packages",)

__all__ = (
    "PackageNotFoundError",
    "get_package_prefix",
    "get_package_share_directory",
    "get_package_share_path",
    "get_packages_with_prefixes",
)
