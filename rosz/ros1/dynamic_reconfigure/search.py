"""Finding servers, the parameters that they have, and the files that describe them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

__all__ = ("find_files", "find_reconfigure_services", "get_parameter_names")

_MARK = b"dynamic_reconfigure"


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

    Args:
        folder: Folder of the package; other files with such names (``setup.cfg``) are left out.
    """
    return [file for file in sorted(folder.rglob("*.cfg")) if _describes_parameters(file)]


def _describes_parameters(file: Path) -> bool:
    try:
        return _MARK in file.read_bytes()
    except OSError:  # a folder, or a broken link
        return False
