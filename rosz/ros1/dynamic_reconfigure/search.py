"""Finding servers, and the parameters that they have."""

from __future__ import annotations

from typing import Any

__all__ = ("find_reconfigure_services", "get_parameter_names")


def find_reconfigure_services() -> list[str]:
    """Return the sorted names of all servers; works before ``init_node`` as well."""
    from rosz.reconfigure import find_servers
    from rosz.ros1 import state

    return find_servers(state.context().graph.refresh())


def get_parameter_names(descr: Any) -> list[str]:
    """Return the names of the parameters of a module such as ``my_pkg.cfg.TutorialsConfig``."""
    return list(descr.defaults)
