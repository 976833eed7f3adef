"""The fields of a message in ROS 1, where they are not those of the class's schema."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from rosz.message.schema import SEQ, Slot, slots

__all__ = ("ros1_fields",)

_ADDED_BY_ROS2: dict[str, set[str]] = {
    "sensor_msgs/Range": {"variance"},
    "shape_msgs/SolidPrimitive": {"polygon"},
    "visualization_msgs/Marker": {"texture_resource", "texture", "uv_coordinates", "mesh_file"},
}
"""Fields that are not in ROS 1's definition of a type. Decoding leaves them at their defaults."""

_STAMPS = {"builtin_interfaces/Time": "uint32", "builtin_interfaces/Duration": "int32"}
"""The type of both numbers of ROS 1's built-in ``time`` and ``duration``."""


def ros1_fields(cls: Any) -> tuple[Slot, ...]:
    """Return the fields of a message class in the order of ROS 1's layout."""
    return _ros1_fields(cls)


@lru_cache(maxsize=4096)
def _ros1_fields(cls: Any) -> tuple[Slot, ...]:
    kind = _STAMPS.get(cls._type)
    if kind is not None:
        return tuple(Slot(slot.name, kind, 0, "one", 0) for slot in slots(cls))
    absent = _ADDED_BY_ROS2.get(cls._type, set())
    fields = tuple(slot for slot in slots(cls) if slot.name not in absent)
    return (SEQ, *fields) if cls._sequenced else fields
