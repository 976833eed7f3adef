"""tf2_sensor_msgs: transformed point clouds, also by buffers once it is imported (ROS wiki)."""

from __future__ import annotations

from struct import calcsize
from typing import Any

from rosz.msgs.sensor_msgs.msg import PointCloud2
from rosz.ros1.client.point_cloud2 import create_cloud, read_points
from rosz.ros1.client.tf2_ros import ConvertRegistration, TransformRegistration
from rosz.transforms import FIELD_FORMATS, Pose, compose, pose_of, transform_cloud

__all__ = ("do_transform_cloud",)

_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)
_COORDINATES = 3


def do_transform_cloud(cloud: PointCloud2, transform: Any) -> PointCloud2:
    """Transform the points of a cloud by a TransformStamped.

    The result has one row of little-endian points, without the bytes behind their last field. With
    numpy it is made many times faster.

    Args:
        cloud: Cloud whose first three fields are ``x``, ``y`` and ``z``.
        transform: The transform.
    """
    pose, header = pose_of(transform.transform), transform.header
    packed = _packed(cloud)
    if packed is not None:
        return transform_cloud(packed, pose, header, [field.name for field in packed.fields[:3]])
    moved = [
        (*compose(pose, Pose((x, y, z), _NO_ROTATION)).translation, *rest)
        for x, y, z, *rest in read_points(cloud)
    ]
    return create_cloud(header, cloud.fields, moved)


def _packed(cloud: PointCloud2) -> PointCloud2 | None:
    """Return a cloud in the layout of the result; None without numpy, or for unusual clouds."""
    try:
        import numpy as np
    except ImportError:
        return None
    fields = sorted(cloud.fields, key=lambda field: field.offset)
    names = [field.name for field in fields]
    kinds = [FIELD_FORMATS.get(field.datatype, "") for field in fields]
    floats = all(kind in "fd" for kind in kinds[:3])
    ends = [f.offset + calcsize(f"={k}") * f.count for f, k in zip(fields, kinds, strict=True)]
    apart = all(field.offset >= end for end, field in zip(ends, fields[1:], strict=False))
    shape, strides = (cloud.height, cloud.width), (cloud.row_step, cloud.point_step)
    data = bytes(cloud.data)
    if (
        len(fields) < _COORDINATES
        or fields != cloud.fields
        or len(set(names)) < len(names)
        or not (all(kinds) and floats and apart)
        or any(field.count != 1 for field in fields[:_COORDINATES])
        or not max(ends) * cloud.width <= cloud.point_step * cloud.width <= cloud.row_step
        or len(data) < cloud.height * cloud.row_step
    ):
        return None

    def layout(order: str, size: int) -> Any:
        formats = [(order + k, (f.count,)) for f, k in zip(fields, kinds, strict=True)]
        offsets = [field.offset for field in fields]
        return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})

    source = np.ndarray(shape, layout("><"[not cloud.is_bigendian], strides[1]), data, 0, strides)
    points = np.zeros(source.size, layout("<", max(ends)))
    for name in names:
        points[name] = source[name].reshape(points[name].shape)
    return PointCloud2(
        height=1,
        width=points.size,
        fields=cloud.fields,
        point_step=max(ends),
        row_step=points.nbytes,
        data=points.tobytes(),
    )


TransformRegistration().add(PointCloud2, do_transform_cloud)
ConvertRegistration().add_to_msg(PointCloud2, lambda cloud: cloud)
ConvertRegistration().add_from_msg(PointCloud2, lambda cloud: cloud)
