"""roslib.packages: packages and the files in them."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from rosz.packages import Package
from rosz.ros1.rospkg import MANIFEST_FILE, PACKAGE_FILE, ResourceNotFound, RosPack

__all__ = (
    "MANIFEST_FILE",
    "PACKAGE_FILE",
    "InvalidROSPkgException",
    "MultipleNodesException",
    "ROSPkgException",
    "find_node",
    "find_resource",
    "get_dir_pkg",
    "get_pkg_dir",
    "get_pkg_subdir",
    "list_pkgs",
    "list_pkgs_by_path",
    "resource_file",
)


class ROSPkgException(Exception):
    """Root of the errors of packages."""


class InvalidROSPkgException(ROSPkgException):
    """There is no such package."""


class MultipleNodesException(ROSPkgException):
    """A package has several executables of one name."""


def get_dir_pkg(d: str) -> tuple[str | None, str | None]:
    """Return the folder of the package that a folder lies in, and that folder's name.

    Args:
        d: The folder.

    Returns:
        Twice None if it lies in none.
    """
    here = Path(d).absolute()
    for folder in (here, *here.parents):
        if (folder / PACKAGE_FILE).is_file() or (folder / MANIFEST_FILE).is_file():
            return str(folder), folder.name
    return None, None


def get_pkg_dir(
    package: str,
    required: bool = True,
    ros_root: str | None = None,
    ros_package_path: str | None = None,
) -> str | None:
    """Return the folder of a package.

    Args:
        package: Its name.
        required: Whether it is an error if it is not there; otherwise None is returned.
        ros_root: Not used: there is no such folder any more.
        ros_package_path: Where to look, instead of where the process does.

    Raises:
        InvalidROSPkgException: It is not there.
    """
    paths = None if ros_package_path is None else ros_package_path.split(os.pathsep)
    try:
        return RosPack(paths).get_path(package)
    except ResourceNotFound as error:
        if not required:
            return None
        searched = ":".join(error.ros_paths or ())
        raise InvalidROSPkgException(
            f"Cannot locate installation of package {package}: [rospack] Error: package"
            f" '{package}' not found. ROS_ROOT[{ros_root}] ROS_PACKAGE_PATH[{searched}]"
        ) from error


def get_pkg_subdir(package: str, subdir: str, required: bool = True) -> str | None:
    """Return a folder of a package, which is made if it is not there.

    Args:
        package: Name of the package.
        subdir: Relative path of the folder.
        required: Whether to make it, and to fail where that cannot be; otherwise None is returned.

    Raises:
        InvalidROSPkgException: There is no such package, or something else has that path.
    """
    top = get_pkg_dir(package, required)
    if top is None:
        return None
    folder = Path(top, subdir)
    if folder.is_dir():
        return str(folder)
    if not required:
        return None
    if folder.exists():
        raise InvalidROSPkgException(
            f"Package '{package}' is improperly configured: file {folder} is preventing the"
            " creation of a directory"
        )
    folder.mkdir(parents=True)
    return str(folder)


def resource_file(package: str, subdir: str, resource_name: str) -> str:
    """Return the path of a file in a folder of a package; it need not be there.

    Raises:
        InvalidROSPkgException: There is no such package.
    """
    folder = get_pkg_subdir(package, subdir, required=False)
    top = folder or str(Path(get_pkg_dir(package) or "", subdir))
    return str(Path(top, resource_name))


def find_node(pkg: str, node_type: str, rospack: RosPack | None = None) -> list[str]:
    """Return the paths of the executables of a name in a package.

    Raises:
        ResourceNotFound: There is no such package.
    """
    return find_resource(pkg, node_type, _is_executable, rospack)


def find_resource(
    pkg: str,
    resource_name: str,
    filter_fn: Callable[[str], bool] | None = None,
    rospack: RosPack | None = None,
) -> list[str]:
    """Return the paths of the files of a name anywhere in a package.

    Args:
        pkg: Name of the package.
        resource_name: Name of the files.
        filter_fn: Gets a path, and tells whether it is wanted.
        rospack: Where to look for the package.

    Raises:
        ResourceNotFound: There is no such package.
    """
    top = Path((rospack or RosPack()).get_path(pkg))
    found = [str(file) for file in Package(pkg, top).files(resource_name)]
    return [path for path in found if filter_fn is None or filter_fn(path)]


def _is_executable(path: str) -> bool:
    return os.access(path, os.R_OK | os.X_OK)


def list_pkgs() -> list[str]:
    """Return the names of all packages."""
    return RosPack().list()


def list_pkgs_by_path(path: str, packages: list[str] | None = None) -> list[str]:
    """Add the names of the packages in a folder to a list, and return it.

    Args:
        path: The folder.
        packages: A list to add to; a new one when not given.
    """
    found = [] if packages is None else packages
    found += RosPack([path]).list()
    return found
