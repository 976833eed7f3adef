"""The fields of a message in ROS 1, where they are not those of the class's schema."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from rosz.message.base import SEQ, Sequenced, Slot, slots

__all__ = ("ros1_fields",)

_ADDED_BY_ROS2 = {
    "sensor_msgs/Range": {"variance"},
    "shape_msgs/SolidPrimitive": {"polygon"},
    "visualization_msgs/Marker": {"texture_resource", "texture", "uv_coordinates", "mesh_file"},
}
"""Fields that are not in ROS 1's definition of a type. Decoding leaves them at their defaults."""

_STAMPS = {"builtin_interfaces/Time": "uint32", "builtin_interfaces/Duration": "int32"}
"""The type of both numbers of ROS 1's built-in ``time`` and ``duration``."""


@lru_cache(maxsize=4096)
def ros1_fields(cls: Any) -> tuple[Slot, ...]:
    """Return the fields of a message class in the order of ROS 1's layout."""
    kind = _STAMPS.get(cls._type)
    if kind is not None:
        return tuple(Slot(slot.name, kind, 0, "one", 0) for slot in slots(cls))
    absent = _ADDED_BY_ROS2.get(cls._type, frozenset())
    fields = tuple(slot for slot in slots(cls) if slot.name not in absent)
    return (SEQ, *fields) if issubclass(cls, Sequenced) else fields
