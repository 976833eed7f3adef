"""ament_index_python: where packages lie, as ROS 2's programs ask for it.

There is no install space: the share folder of a package is its folder on the package path.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from rosz.environment import Environment, package_index
from rosz.errors import PackageNotFound
from rosz.packages import PackageIndex


class PackageNotFoundError(KeyError):
    """A package is not on the package path."""

    def __str__(self) -> str:
        return str(self.args[0])


@cache
def _packages() -> PackageIndex:
    return package_index(Environment.read())


def get_package_share_path(package_name: str, print_warning: bool = True) -> Path:  # noqa: ARG001  # ROS 2's
    """Return the folder of a package.

    Args:
        package_name: Name of the package.
        print_warning: Ignored.

    Raises:
        PackageNotFoundError: The package does not exist.
    """
    try:
        return _packages().find(package_name).path
    except PackageNotFound as error:
        raise PackageNotFoundError(str(error)) from error


def get_package_share_directory(package_name: str, print_warning: bool = True) -> str:
    """Return the folder of a package as text; see `get_package_share_path`."""
    return str(get_package_share_path(package_name, print_warning))


def get_package_prefix(package_name: str) -> str:
    """Return the folder above ``share`` of an installed package, or the folder of the package.

    Raises:
        PackageNotFoundError: The package does not exist.
    """
    folder = get_package_share_path(package_name)
    return str(folder.parent.parent if folder.parent.name == "share" else folder)


def get_packages_with_prefixes() -> dict[str, str]:
    """Return the prefixes of all packages by name; see `get_package_prefix`."""
    return {name: get_package_prefix(name) for name in _packages().names()}
