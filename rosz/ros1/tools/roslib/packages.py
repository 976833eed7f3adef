"""roslib.packages: packages and the files in them (ROS wiki, roslib)."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rosz.packages import Package, manifest_of
from rosz.ros1 import modules
from rosz.ros1.tools import rospkg
from rosz.ros1.tools.rospkg import ResourceNotFound, RosPack

MANIFEST_FILE, PACKAGE_FILE = rospkg.MANIFEST_FILE, rospkg.PACKAGE_FILE
TYPE_SEPARATOR = "/"

_PROVIDED = frozenset({*modules.MODULES, "roscpp", "rosconsole", "rosout", "roswtf"})
"""Packages of ROS itself that are not folders here; their modules need no path."""


class ROSLibException(Exception):
    """Base class of roslib's errors."""


class ROSEnvException(ROSLibException):
    """An environment variable is missing or wrong."""


class ROSPkgException(ROSLibException):
    """Base class of the errors of packages."""


class InvalidROSPkgException(ROSPkgException):
    """A package does not exist."""


class MultipleNodesException(ROSPkgException):
    """A package has several executables of one name."""


def load_manifest(package_name: str, bootstrap_version: str = "0.7") -> None:  # noqa: ARG001  # ROS 1's
    """Add the Python folders of a package and of its dependencies to ``sys.path``.

    Messages do not need this: they can always be imported.

    Args:
        package_name: Package of the program.
        bootstrap_version: Ignored.

    Raises:
        ResourceNotFound: The package does not exist.
    """
    if package_name in _PROVIDED:
        return
    packs = RosPack()
    needed: list[str] = []
    rest = [package_name]
    while rest:
        name = rest.pop(0)
        if name not in needed and name not in _PROVIDED:
            needed.append(name)
            rest += [depend.name for depend in packs.get_manifest(name).depends]
    folders = [
        str(folder)
        for name in needed
        for folder in (Path(packs.get_path(name), "src"), Path(packs.get_path(name), "lib"))
        if folder.is_dir()
    ]
    sys.path[:0] = [folder for folder in folders if folder not in sys.path]


def get_dir_pkg(d: str) -> tuple[str | None, str | None]:
    """Return the folder of the package that a folder lies in, and the name of that folder.

    Args:
        d: The folder.

    Returns:
        None and None if it lies in no package.
    """
    here = Path(d).absolute()
    for folder in (here, *here.parents):
        if manifest_of(folder) is not None:
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
        package: Name of the package.
        required: Whether to raise an error if there is no such package; otherwise return None.
        ros_root: Shown in the error.
        ros_package_path: Folders to search instead of those of the process.

    Raises:
        InvalidROSPkgException: The package does not exist.
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
    """Return a folder of a package; create it if it does not exist.

    Args:
        package: Name of the package.
        subdir: Relative path of the folder.
        required: Whether to create it, and to raise an error if there is no such package;
            otherwise return None.

    Raises:
        InvalidROSPkgException: The package does not exist, or the path is that of a file.
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
    """Return the path of a file in a folder of a package; see `get_pkg_dir`.

    The file need not exist.
    """
    folder = get_pkg_subdir(package, subdir, required=False)
    top = folder or str(Path(get_pkg_dir(package) or "", subdir))
    return str(Path(top, resource_name))


def find_node(pkg: str, node_type: str, rospack: RosPack | None = None) -> list[str]:
    """Return the paths of the executables of a name in a package; see `find_resource`."""
    return find_resource(pkg, node_type, lambda path: os.access(path, os.R_OK | os.X_OK), rospack)


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
        filter_fn: Function of a path that returns whether to include it.
        rospack: Packages to search; those of the process when not given.

    Raises:
        ResourceNotFound: The package does not exist.
    """
    top = Path((rospack or RosPack()).get_path(pkg))
    paths = [str(file) for file in Package(pkg, top).files(resource_name)]
    return [path for path in paths if filter_fn is None or filter_fn(path)]


def list_pkgs() -> list[str]:
    """Return the names of all packages."""
    return RosPack().list()


def list_pkgs_by_path(path: str, packages: list[str] | None = None) -> list[str]:
    """Add the names of the packages in a folder to a list, and return it.

    Args:
        path: The folder.
        packages: List to extend; a new one when not given.
    """
    names = [] if packages is None else packages
    names += RosPack([path]).list()
    return names


def get_depends(package: str, rospack: RosPack | None = None) -> list[str]:
    """Return a package and all packages that it depends on, the deepest first.

    Raises:
        ResourceNotFound: The package does not exist.
    """
    return [*reversed((rospack or RosPack()).get_depends(package)), package]


def list_package_resources_by_dir(
    package_dir: str,
    include_depends: bool,  # noqa: ARG001  # ROS 1's
    subdir: str,
    rfilter: Callable[[str], bool] = os.path.isfile,
) -> list[str]:
    """Return the names of the files in a folder of a package.

    Args:
        package_dir: Folder of the package.
        include_depends: Ignored.
        subdir: Folder in it.
        rfilter: Function of a path that returns whether to include it.
    """
    folder = Path(package_dir, subdir)
    return sorted(
        file.name for file in (folder.iterdir() if folder.is_dir() else ()) if rfilter(str(file))
    )


def list_package_resources(
    package: str,
    include_depends: bool,
    subdir: str,
    rfilter: Callable[[str], bool] = os.path.isfile,
) -> list[str]:
    """Return the names of the files in a folder of a package, as resources.

    Args:
        package: Name of the package.
        include_depends: Whether to add those of the packages that it depends on.
        subdir: Folder in it.
        rfilter: Function of a path that returns whether to include it.

    Raises:
        ResourceNotFound: The package does not exist.
    """
    packs = RosPack()
    names = []
    for name in (package, *(packs.get_depends(package) if include_depends else ())):
        own = list_package_resources_by_dir(packs.get_path(name), False, subdir, rfilter)
        names += own if name == package else [f"{name}/{each}" for each in own]
    return names


def get_master() -> Any:
    """Return the Master API for this program, as ``rospy.get_master`` does."""
    from rosz.ros1.client.rospy import get_master as get

    return get()


def rospack_depends(pkg: str) -> list[str]:
    """Return the packages that a package depends on; see `get_depends`."""
    return list(RosPack().get_depends(pkg))


def rospack_depends_1(pkg: str) -> list[str]:
    """Return the packages that a package itself names; see `rospack_depends`."""
    return list(RosPack().get_depends(pkg, implicit=False))


def rospack_depends_on(pkg: str) -> list[str]:
    """Return the packages that depend on a package; see `rospack_depends`."""
    return list(RosPack().get_depends_on(pkg))


def rospack_depends_on_1(pkg: str) -> list[str]:
    """Return the packages that name a package themselves; see `rospack_depends`."""
    return list(RosPack().get_depends_on(pkg, implicit=False))


_interactive = False


def set_interactive(interactive: bool) -> None:
    """Set whether a person types into the program."""
    global _interactive  # noqa: PLW0603  # ROS 1's
    _interactive = interactive


def is_interactive() -> bool:
    """Return whether a person types into the program."""
    return _interactive
