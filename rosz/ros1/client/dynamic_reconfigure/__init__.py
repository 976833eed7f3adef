"""dynamic_reconfigure: ROS 1's names for `rosz.reconfigure`.

``.cfg`` files run unchanged, and the modules that catkin generates from them can be imported
without a build: ``from my_pkg.cfg import TutorialsConfig`` (ROS wiki, dynamic_reconfigure).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

__all__ = (
    "DynamicReconfigureCallbackException",
    "DynamicReconfigureException",
    "DynamicReconfigureParameterException",
    "find_reconfigure_services",
    "get_parameter_names",
)

_MARK = b"dynamic_reconfigure"


class DynamicReconfigureException(Exception):
    """Base class of the exceptions of dynamic_reconfigure."""


class DynamicReconfigureParameterException(DynamicReconfigureException):
    """The parameter does not exist, or it cannot have a value."""


class DynamicReconfigureCallbackException(DynamicReconfigureException):
    """A server's callback returned nothing, or a server refused or did not reply."""


def find_reconfigure_services() -> list[str]:
    """Return the sorted names of all servers; works before ``init_node`` as well."""
    from rosz.reconfigure import find_servers
    from rosz.ros1 import state

    return find_servers(state.context().graph.refresh())


def get_parameter_names(descr: Any) -> list[str]:
    """Return the names of the parameters of a module such as ``my_pkg.cfg.TutorialsConfig``."""
    return list(descr.defaults)


def find_files(folder: Path) -> list[Path]:
    """Return the sorted ``.cfg`` files of a package that describe parameters.

    Other files with such names (``setup.cfg``) are left out.
    """
    return [file for file in sorted(folder.rglob("*.cfg")) if _describes_parameters(file)]


def _describes_parameters(file: Path) -> bool:
    try:
        return _MARK in file.read_bytes()
    except OSError:  # a folder, or a broken link
        return False
