"""A node as ROS 2 knows it: the services of its parameters, and the definitions of its types.

`detector` finds out when a node needs these services, `parameters` provides them, `remote` calls
those of other nodes, `events` publishes their changes, `values` converts them, and `types` serves
definitions and requests those of other nodes. The names are imported on first use, as few nodes
need them.
"""

from __future__ import annotations

from rosz.lazy import exports_of

TYPE_CHECKING = False  # typing takes long to import
if TYPE_CHECKING:
    from rosz.node.ros2.remote import SERVICES, RemoteParameters, tree_of
    from rosz.node.ros2.types import event_class, request_action, request_definition, request_type
    from rosz.node.ros2.values import from_ros2, to_ros2, to_type, type_of
else:
    __getattr__ = exports_of(__name__)

__all__ = (
    "SERVICES",
    "RemoteParameters",
    "event_class",
    "from_ros2",
    "request_action",
    "request_definition",
    "request_type",
    "to_ros2",
    "to_type",
    "tree_of",
    "type_of",
)
