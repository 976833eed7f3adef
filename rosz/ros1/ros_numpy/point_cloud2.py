"""ros_numpy.point_cloud2: PointCloud2 as an array of records, one for each point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from rosz.msgs.sensor_msgs.msg import PointCloud2, PointField
from rosz.ros1.ros_numpy.registry import converts_from_numpy, converts_to_numpy
from rosz.transforms import FIELD_FORMATS

__all__ = (
    "DUMMY_FIELD_PREFIX",
    "array_to_pointcloud2",
    "dtype_to_fields",
    "fields_to_dtype",
    "get_xyz_points",
    "merge_rgb_fields",
    "nptype_to_pftype",
    "pftype_sizes",
    "pftype_to_nptype",
    "pointcloud2_to_array",
    "pointcloud2_to_xyz_array",
    "split_rgb_field",
    "type_mappings",
)

DUMMY_FIELD_PREFIX = "__"
"""Prefix of the names of bytes that belong to no field."""

type_mappings: list[tuple[int, np.dtype[Any]]] = [
    (number, np.dtype(kind)) for number, kind in FIELD_FORMATS.items()
]
pftype_to_nptype = dict(type_mappings)
nptype_to_pftype = {kind: number for number, kind in type_mappings}
pftype_sizes = {number: kind.itemsize for number, kind in type_mappings}

_COLORS = ("r", "g", "b")


@converts_to_numpy(PointField, plural=True)
def fields_to_dtype(fields: Sequence[PointField], point_step: int) -> list[Any]:
    """Return names and types of fields, in the order of the list, for ``numpy.dtype``.

    Each byte before, between and after the fields has a name of its own.
    """
    described: list[Any] = []
    end = 0

    def pad(until: int) -> int:
        described.extend((f"{DUMMY_FIELD_PREFIX}{at}", np.uint8) for at in range(end, until))
        return max(end, until)

    for field in fields:
        end = pad(field.offset)
        kind = pftype_to_nptype[field.datatype]
        described.append((field.name, _several(kind, field.count)))
        end += kind.itemsize * field.count
    end = pad(point_step)
    return described


@converts_from_numpy(PointField, plural=True)
def dtype_to_fields(dtype: Any) -> list[PointField]:
    """Return the fields of a type of records.

    Raises:
        TypeError: A PointField cannot have the type of a field.
    """
    fields = []
    for name in dtype.names:
        kind, offset = dtype.fields[name][:2]
        item, shape = kind.subdtype or (kind, ())
        if item not in nptype_to_pftype:
            known = ", ".join(one.name for one in nptype_to_pftype)
            raise TypeError(f"field '{name}' has type {item}; a PointField may have {known}")
        fields.append(PointField(name, offset, nptype_to_pftype[item], int(np.prod(shape))))
    return fields


@converts_to_numpy(PointCloud2)
def pointcloud2_to_array(cloud_msg: PointCloud2, squeeze: bool = True) -> Any:
    """Return the points of a cloud without copying them; the array is read-only.

    Args:
        cloud_msg: The cloud.
        squeeze: Whether a cloud of one row becomes an array of one dimension.
    """
    order: Literal[">", "<"] = ">" if cloud_msg.is_bigendian else "<"
    kinds = [
        _several(pftype_to_nptype[field.datatype].newbyteorder(order), field.count)
        for field in cloud_msg.fields
    ]
    point = np.dtype(
        {
            "names": [field.name for field in cloud_msg.fields],
            "formats": kinds,
            "offsets": [field.offset for field in cloud_msg.fields],
            "itemsize": cloud_msg.point_step,
        }
    )
    height, width = cloud_msg.height, cloud_msg.width
    data: Any = cloud_msg.data
    if squeeze and height == 1:
        return np.ndarray((width,), point, data)
    row = cloud_msg.row_step or width * cloud_msg.point_step
    return np.ndarray((height, width), point, data, strides=(row, cloud_msg.point_step))


@converts_from_numpy(PointCloud2)
def array_to_pointcloud2(cloud_arr: Any, stamp: Any = None, frame_id: str | None = None) -> Any:
    """Return the cloud of an array of records.

    Args:
        cloud_arr: The points, in one or two dimensions.
        stamp: Time of the header.
        frame_id: Frame of the header.

    Raises:
        TypeError: A PointField cannot have the type of a field.
    """
    points = np.atleast_2d(cloud_arr)
    cloud = PointCloud2(
        height=points.shape[0],
        width=points.shape[1],
        fields=dtype_to_fields(points.dtype),
        point_step=points.dtype.itemsize,
        row_step=points.dtype.itemsize * points.shape[1],
        is_dense=all(bool(np.isfinite(points[name]).all()) for name in points.dtype.names or ()),
        data=points.tobytes(),
    )
    if stamp is not None:
        cloud.header.stamp = stamp
    if frame_id is not None:
        cloud.header.frame_id = frame_id
    return cloud


def merge_rgb_fields(cloud_arr: Any) -> Any:
    """Return points whose fields r, g and b are one field ``rgb`` of float32, as PCL has it."""
    r, g, b = (np.asarray(cloud_arr[name], np.uint32) for name in _COLORS)
    packed = np.asarray((r << 16) | (g << 8) | b, np.uint32)
    return _replaced(cloud_arr, _COLORS, {"rgb": packed.view(np.float32)})


def split_rgb_field(cloud_arr: Any) -> Any:
    """Return points whose field ``rgb`` of float32 is the fields r, g and b of uint8."""
    packed = np.ascontiguousarray(cloud_arr["rgb"]).view(np.uint32)
    shifts = zip(_COLORS, (16, 8, 0), strict=True)
    colors = {name: ((packed >> shift) & 255).astype(np.uint8) for name, shift in shifts}
    return _replaced(cloud_arr, ("rgb",), colors)


def get_xyz_points(cloud_array: Any, remove_nans: bool = True, dtype: Any = float) -> Any:
    """Return the coordinates x, y and z along the last axis.

    Args:
        cloud_array: The points.
        remove_nans: Whether to leave out points with a NaN or an infinite coordinate.
        dtype: Type of the coordinates.
    """
    if remove_nans:
        cloud_array = cloud_array[
            np.logical_and.reduce([np.isfinite(cloud_array[axis]) for axis in "xyz"])
        ]
    points = np.empty((*cloud_array.shape, 3), dtype)
    for at, axis in enumerate("xyz"):
        points[..., at] = cloud_array[axis]
    return points


def pointcloud2_to_xyz_array(cloud_msg: PointCloud2, remove_nans: bool = True) -> Any:
    """Return the coordinates of the points of a cloud; see `get_xyz_points`."""
    return get_xyz_points(pointcloud2_to_array(cloud_msg), remove_nans=remove_nans)


def _several(kind: Any, count: int) -> Any:
    return kind if count == 1 else np.dtype((kind, (count,)))


def _replaced(points: Any, names: Sequence[str], columns: dict[str, Any]) -> Any:
    """Return points without some fields, and with other ones after the rest."""
    kept = [name for name in points.dtype.names if name not in names]
    kinds = [(name, points.dtype.fields[name][0]) for name in kept]
    kinds += [(name, column.dtype) for name, column in columns.items()]
    made = np.zeros(points.shape, np.dtype(kinds))
    for name in kept:
        made[name] = points[name]
    for name, column in columns.items():
        made[name] = column
    return made
