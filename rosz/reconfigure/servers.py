"""Which nodes have settings, and under what names."""

from __future__ import annotations

from rosz.graph import View
from rosz.msgs.dynamic_reconfigure.srv import Reconfigure

__all__ = ("DESCRIPTIONS", "SET", "UPDATES", "find_servers")

DESCRIPTIONS = "parameter_descriptions"
UPDATES = "parameter_updates"
SET = "set_parameters"


def find_servers(view: View) -> list[str]:
    """Return the names of all servers, which are mostly those of their nodes, sorted.

    A service ``set_parameters`` of another type, as every ROS 2 node has, is none.
    """
    return sorted(
        name.removesuffix(f"/{SET}")
        for name, types in view.services().items()
        if name.endswith(f"/{SET}") and Reconfigure._type_name in types
    )
